"""How much of a result is luck?

    python experiments/repeatability.py recording=FOLDER [actor=actor.yaml] [cameras=[12,6]] [starts=20] [frames=60]
    python experiments/repeatability.py sequences=[walk,talk] [overrides=[images.background=clip]]
    python experiments/repeatability.py 'synth={motion: talk, actors: 2, seed: 3}'

A clip is tracked from many initial poses: the one that is found for it, its root moved by 1 cm and every angle by 2
degrees, drawn anew for each. The table tells the spread (95th percentile minus 5th) of the joints' mean error over the
runs, and in how many a limb was lost: one of its joints was more than 200 mm off for five frames on end. Clips are a
folder, rows of the experiments `sequences` and `together`, or what `sogjax synth` renders. Several actors:
`actor=[a.yaml,b.yaml]`. Writes `repeatability.csv`.
"""

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body
from sogjax.io.files import csv_text, write_file
from sogjax.io.recording import Recording
from sogjax.model.body import Body, dof_slices
from sogjax.quality.evaluation import GroupEvaluation
from sogjax.quality.metrics import LOST_DISTANCE, lost_points
from sogjax.run.actors import Actors
from sogjax.run.background import learn_background
from sogjax.run.initial_pose import SOURCES, InitialPose, PoseRequest, find_initial_pose
from sogjax.run.judge import compared
from sogjax.run.recordings import file_list, upright
from sogjax.run.terminal import say
from sogjax.run.track import opened_clip, track_recording
from sogjax.settings.compose import track_config
from sogjax.settings.run import TrackConfig
from sogjax.study.experiment import yardsticks
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.study.source import Source, rendered_source, source_named
from sogjax.study.table import ruled_table
from sogjax.study.true_poses import limb_of

METRES, DEGREES = 0.01, 2.0
"""By which an initial pose is moved: the root, in a drawn direction, and every angle, up or down."""
MM = 1000.0


@dataclass(frozen=True)
class Outcome:
    """What came of one initial pose."""

    mean: float
    """Metres: the mean distance of all actors' joints to the truth, over all frames."""
    lost: tuple[str, ...]
    """Limbs that were lost: a joint of theirs was too far off for five frames on end."""


@dataclass(frozen=True)
class Repeated:
    """What came of all initial poses of a clip."""

    name: str
    outcomes: tuple[Outcome, ...]

    @property
    def means(self) -> Float[np.ndarray, "run"]:
        """Mean errors of the runs, in metres."""
        return np.array([outcome.mean for outcome in self.outcomes])

    @property
    def spread(self) -> float:
        """The 95th percentile of the runs' mean errors minus the 5th, in metres."""
        low, high = np.percentile(self.means, [5.0, 95.0])
        return float(high - low)

    @property
    def share_lost(self) -> float:
        """In what share of the runs a limb was lost."""
        return float(np.mean([bool(outcome.lost) for outcome in self.outcomes]))


def moved_pose(
    bodies: Sequence[Body], pose: Float[np.ndarray, "dof"], rng: np.random.Generator
) -> Float[np.ndarray, "dof"]:
    """A pose of several bodies beside each other whose roots are moved by 1 cm and whose angles by 2 degrees.

    The root's direction and each angle's sign are drawn; nothing is moved beyond its limits.
    """
    parts = [_moved(body, pose[part], rng) for body, part in zip(bodies, dof_slices(bodies), strict=True)]
    return np.concatenate(parts).astype(pose.dtype)


def _moved(body: Body, pose: Float[np.ndarray, "dof"], rng: np.random.Generator) -> Float[np.ndarray, "dof"]:
    skeleton = body.skeleton
    used = np.asarray(skeleton.parameter_transform) != 0.0
    slides = (used & ~np.asarray(skeleton.revolute)[:, None]).any(axis=0)
    direction = np.where(slides, rng.standard_normal(len(pose)), 0.0)
    signs = rng.choice([-1.0, 1.0], len(pose))
    step = METRES * direction / max(float(np.linalg.norm(direction)), 1e-9)
    moved = pose + np.where(slides, step, np.radians(DEGREES) * signs)
    return np.clip(moved, np.asarray(skeleton.dof_lower), np.asarray(skeleton.dof_upper))


def outcomes_of(
    recording: Recording,
    actors: Sequence[Body],
    config: TrackConfig,
    count: int,
    seed: int = 0,
    distance: float = LOST_DISTANCE,
) -> Iterator[Outcome]:
    """Track a clip from so many initial poses: the one that is found for it, moved anew for each.

    Args:
        recording: with a truth.
        actors: in their own upright frames.
        config: of the track.
        count: of initial poses.
        seed: from which the moves are drawn; more poses begin with the same ones.
        distance: metres; a joint that is farther off for five frames on end is lost.

    Raises:
        InputError: no initial pose is found, or nothing can be compared.
    """
    for start in moved_starts(recording, actors, config, range(count), seed):
        yield outcome_of(compared(recording, _tracked_from(start, recording, actors, config)), distance)


def moved_starts(
    recording: Recording, actors: Sequence[Body], config: TrackConfig, numbers: Iterable[int], seed: int = 0
) -> Iterator[InitialPose]:
    """The initial pose that is found for a clip, moved anew for each number.

    Raises:
        InputError: none is found.
    """
    clip = opened_clip(recording, config)
    background = learn_background(clip, config.images.background, config.images.cache)
    found = find_initial_pose(PoseRequest(clip, background, Actors(tuple(actors)), config), SOURCES)
    bodies = [upright(actor, recording) for actor in actors]
    for number in numbers:
        pose = moved_pose(bodies, np.asarray(found.pose), np.random.default_rng([seed, number]))
        yield replace(found, pose=pose, source=f"{found.source}, moved")


def _tracked_from(start: InitialPose, recording: Recording, actors: Sequence[Body], config: TrackConfig) -> Mapping:
    return track_recording(recording, actors, config, pose_sources=(lambda _: start,)).result_so_far.motions


def outcome_of(evaluation: GroupEvaluation | None, distance: float = LOST_DISTANCE) -> Outcome:
    """The outcome of a run that was compared with its truth.

    Raises:
        InputError: there is no truth of joints.
    """
    of_actors = {} if evaluation is None else evaluation.evaluations
    joints = {name: each.joints for name, each in of_actors.items() if each.joints is not None}
    if not joints:
        raise InputError("recording: nothing of its joints can be compared; give one with ground_truth.npz")
    lost: dict[str, None] = {}
    for name, points in joints.items():
        prefix = f"{name}/" if len(joints) > 1 else ""
        for point in lost_points(points.errors, points.names, np.arange(len(points.errors)), distance):
            lost[limb_of(prefix + point.name)] = None
    errors = np.concatenate([points.errors.ravel() for points in joints.values()])
    return Outcome(float(np.nanmean(errors)), tuple(lost))


def repeated_table(found: Sequence[Repeated]) -> str:
    """A line for each clip: the runs' mean errors, their spread, and how many lost a limb."""
    titles = ["clip", "runs", "joints, mm", "5 %", "95 %", "spread", "with a lost limb", "share", "lost limbs"]
    return ruled_table([titles, *(_line(each) for each in found)])


def _line(found: Repeated) -> list[str]:
    counts = Counter(limb for outcome in found.outcomes for limb in outcome.lost)
    low, high = np.percentile(found.means, [5.0, 95.0])
    lost = sum(bool(outcome.lost) for outcome in found.outcomes)
    numbers = [f"{MM * value:.1f}" for value in (found.means.mean(), low, high, found.spread)]
    limbs = ", ".join(f"{limb} ({number})" for limb, number in counts.most_common())
    share = f"{100.0 * found.share_lost:.0f} %"
    return [found.name, str(len(found.outcomes)), *numbers, str(lost), share, limbs]


def write_repeated(path: Path, found: Sequence[Repeated]) -> None:
    """A row for each run: its clip, its number, its mean error in millimetres, the limbs that it lost."""
    lines: list[list[object]] = [["clip", "run", "joints mm", "lost limbs"]]
    for each in found:
        for number, outcome in enumerate(each.outcomes):
            lines.append([each.name, number, f"{MM * outcome.mean:.2f}", "; ".join(outcome.lost)])
    write_file(path, csv_text(lines))


@dataclass
class Settings:
    """What is repeated, as `key=value` on the command line."""

    recording: str | None = None
    """A folder with ground truth."""
    sequences: list[str] = field(default_factory=list)
    """Rows of the experiments `sequences` and `together`."""
    synth: dict[str, Any] = field(default_factory=dict)
    """Settings of `sogjax synth`."""
    actor: Any = None
    """A file, or a list of those of several actors; null: made of the example poses with all cameras, and kept."""
    cameras: list[int] = field(default_factory=list)
    """Numbers of cameras, each taken evenly; none: all."""
    starts: int = 20
    frames: int = 60
    """At most, from the first."""
    seed: int = 0
    far: float = LOST_DISTANCE
    """Metres: a joint that is farther off is lost."""
    overrides: list[str] = field(default_factory=list)
    """Of track."""
    out: str = "outputs/repeatability"
    """Where actors, cells and the results are kept."""


def main() -> None:
    """Track, print the table, and write the file."""
    settings = settings_from(Settings)
    if settings.starts < 1:
        raise InputError(f"starts={settings.starts}: give 1 or more")
    found = [
        _repeated(settings, source, count)
        for source in _sources(settings)
        for count in settings.cameras or [len(source.recording.rig.names)]
    ]
    path = Path(settings.out) / "repeatability.csv"
    print(machine_line(), repeated_table(found), sep="\n\n")
    write_repeated(path, found)
    print(f"\n{path}")


def _sources(settings: Settings) -> Iterator[Source]:
    """The clips."""
    if sum(map(bool, (settings.recording, settings.sequences, settings.synth))) != 1:
        raise InputError("give one of recording=FOLDER, sequences=[walk,talk] and 'synth={motion: talk, actors: 2}'")
    folder = Path(settings.out)
    if settings.recording:
        yield source_named(settings.recording, settings.frames, folder)
    for chosen in yardsticks(settings.sequences).values() if settings.sequences else filter(None, [settings.synth]):
        yield rendered_source(chosen, settings.frames, folder)


def _repeated(settings: Settings, source: Source, cameras: int) -> Repeated:
    """The outcomes with so many cameras; each is told as it comes."""
    cache = f"images.cache={json.dumps(str(source.cell_folder))}"
    config = track_config([cache, f"stop={source.num_frames}", *settings.overrides], recording=source.path)
    recording, name = source.seen_by(source.cameras(cameras)), f"{source.name}, {cameras} cameras"
    outcomes: list[Outcome] = []
    for outcome in outcomes_of(
        recording, _actors(settings, source), config, settings.starts, settings.seed, settings.far
    ):
        outcomes.append(outcome)
        lost = f", lost: {', '.join(outcome.lost)}" if outcome.lost else ""
        say(f"{name}, run {len(outcomes)}: {MM * outcome.mean:.1f} mm{lost}")
    return Repeated(name, tuple(outcomes))


def _actors(settings: Settings, source: Source) -> list[Body]:
    """In their own upright frames."""
    return source.actors if settings.actor is None else [load_body(path) for path in file_list(settings.actor)]


if __name__ == "__main__":
    run_script(main)
