"""Do colours of left and right in a clip tell that a limb is lost?

    python experiments/clip_sides.py runs=[FOLDER,...]

Of folders that `whole_runs.py` made: of each actor's arms and legs how far the worse one's outer joints are from the
truth, and how far the colours of left and right are apart where they were tracked, and in the actor's file.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from omegaconf import MISSING

from sogjax.io.actor_file import load_body
from sogjax.io.ground_truth import GroundTruth, load_ground_truth
from sogjax.io.motion import Motion, load_motion
from sogjax.io.recording import open_recording
from sogjax.io.recording_files import GROUND_TRUTH, VIDEOS
from sogjax.model.body import Body
from sogjax.quality.markers import joint_errors
from sogjax.run.clip_sides import UNLIKE, colors_apart
from sogjax.run.recordings import upright
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.study.table import ruled_table

OUTER = {"arm": ("elbow", "wrist"), "leg": ("knee", "ankle")}
LOST, FOUND = 0.13, 0.08
"""Metres: the outer joints of a lost limb are farther off on average, those of a found one nearer."""


@dataclass
class Settings:
    """What is looked at, as `key=value` on the command line."""

    runs: list[str] = field(default_factory=lambda: MISSING)
    """Folders of `whole_runs.py`."""


@dataclass(frozen=True)
class Sides:
    """The two limbs of a kind of one actor."""

    run: str
    actor: str
    kind: str
    off: float
    """Metres: the mean distance of the worse one's outer joints to the truth."""
    apart: float
    """How far the colours are apart where they were tracked (sRGB, 0 to 1)."""


def sides_of(folder: Path) -> list[Sides]:
    """The arms and legs of everybody in a run."""
    recording, results = open_recording(folder / "recording"), folder / "results"
    known = load_ground_truth(GROUND_TRUTH.of(VIDEOS.of(recording.path).resolve().parent))
    people = [known.subject(name) for name in known.subjects] if known.subjects else [known]
    motions = [load_motion(path) for path in sorted(results.glob("motion*.npz"))]
    bodies = [load_body(path) for path in sorted(results.glob("actor*.yaml"))]
    actors: dict[str, tuple[Body, Motion]] = {
        body.name: (upright(body, recording), motion) for body, motion in zip(bodies, motions, strict=True)
    }
    return [
        Sides(folder.name, name, kind, _off(actors[name][1], people, kind), apart)
        for name, of_actor in colors_apart(recording, actors, "lab").items()
        for names, apart in of_actor.items()
        for kind in OUTER
        if names.endswith(kind)
    ]


def _off(motion: Motion, people: list[GroundTruth], kind: str) -> float:
    """Held against the person whom the motion suits best."""
    errors = [found for person in people if (found := joint_errors(motion, person)) is not None]
    best = min(errors, key=lambda found: float(np.nanmean(found.errors)))
    means = dict(zip(best.names, np.nanmean(best.errors, axis=0), strict=True))
    return max(float(np.mean([means[f"{side}_{joint}"] for joint in OUTER[kind]])) for side in ("left", "right"))


def main() -> None:
    """Print the table, and how many limbs the colours tell."""
    settings = settings_from(Settings)
    sides = [each for run in settings.runs for each in sides_of(Path(run))]
    print(machine_line())
    rows = [[each.run, each.actor, each.kind, f"{1000 * each.off:.0f}", f"{each.apart:.3f}"] for each in sides]
    print(ruled_table([["run", "actor", "limbs", "off, mm", "colours apart"], *rows]))
    for kind in OUTER:
        lost = [each.apart > UNLIKE for each in sides if each.kind == kind and each.off > LOST]
        found = [each.apart > UNLIKE for each in sides if each.kind == kind and each.off < FOUND]
        print(
            f"{kind}s more than {UNLIKE:g} apart: {sum(lost)} of {len(lost)} lost, {sum(found)} of {len(found)} found"
        )


if __name__ == "__main__":
    run_script(main)
