"""What tracking the demo costs: solvers, quad-trees, end to end against decoding alone."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from end_to_end import decoding_rate
from jaxtyping import Array, UInt8
from quantities import Quantity, milliseconds
from track_speed import demo_recording

from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.pairs import MEMBERS, TILE
from sogjax.energy.posed import History
from sogjax.energy.similarity import similarity_among
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.quality.evaluation import evaluate_motions
from sogjax.run.actors import ActorRequest, Actors, make_actors
from sogjax.run.background import learn_background
from sogjax.run.initial_pose import SOURCES, PoseRequest, find_initial_pose
from sogjax.run.recordings import opened
from sogjax.run.result import RunResult
from sogjax.run.setup import tracking_setup
from sogjax.run.track import opened_clip, track_recording
from sogjax.settings.compose import track_config
from sogjax.settings.run import TrackConfig
from sogjax.tracking.capacity import first_capacities
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import FrameInput, TrackState
from sogjax.tracking.tracker import Tracker

SOLVERS = ("gauss_newton", "lbfgs", "conditioned_ascent")


@dataclass
class Scene:
    """A recording, and an actor that was made of it."""

    folder: Path
    recording: Recording
    bodies: list[Body]
    frames: int

    @classmethod
    def demo(cls, frames: int) -> "Scene":
        """The demo's, rendered now if it is not there yet."""
        return cls.of(demo_recording(), frames)

    @classmethod
    def of(cls, folder: Path, frames: int) -> "Scene":
        """Some frames of a recording; the actor is made now if it is not kept."""
        recording = opened(str(folder))
        config: TrackConfig = track_config(recording=folder)
        actors = make_actors(ActorRequest.of_track(opened_clip(recording, config), config))
        return cls(folder, recording, list(actors.bodies), min(frames, recording.num_frames))

    def config(self, *overrides: str, frames: int | None = None) -> TrackConfig:
        """The config of a run."""
        return track_config(overrides, recording=self.folder, stop=frames or self.frames)

    def tracked(self, *overrides: str) -> RunResult:
        """A run without files, evaluated."""
        result = track_recording(self.recording, self.bodies, self.config(*overrides)).result_so_far
        assert self.recording.ground_truth is not None
        result.evaluation = evaluate_motions(result.motions, load_ground_truth(self.recording.ground_truth))
        return result


def solver_quantities(scene: Scene) -> Iterator[Quantity]:
    """Every solver with near pairs, and the paper's with all pairs: iterations, energy, marker error, time."""
    alternatives: dict[str, tuple[str, ...]] = {name: (f"solver={name}",) for name in SOLVERS}
    alternatives["conditioned_ascent, all pairs"] = ("solver=conditioned_ascent", "energy.pairs=dense")
    errors = {}
    for name, words in alternatives.items():
        result = scene.tracked(*words)
        assert result.evaluation is not None
        motion = next(iter(result.motions.values()))
        errors[name] = 1000.0 * result.evaluation.summary.mean
        rate = result.times.frames_per_second("step", skipped=3)
        fastest = 1000.0 * float(np.min(result.times.seconds["step"][3:]))
        yield Quantity("solver", f"{name}: iterations per frame", float(np.mean(result.iterations)), "count")
        yield Quantity("solver", f"{name}: final energy x 1000", 1000.0 * float(np.mean(motion.energy)), "energy", True)
        yield Quantity("solver", f"{name}: marker error", errors[name], "mm")
        yield Quantity("solver", f"{name}: least step", fastest, "ms")
        target = 60.0 if name == SOLVERS[0] else None
        yield Quantity("solver", f"{name}: tracking step", rate, "frames/s", True, target)
    worse = errors[SOLVERS[0]] - errors["conditioned_ascent, all pairs"]
    yield Quantity("solver", "default's error over the paper's method's", worse, "mm", target=1.0)


class FirstStep(NamedTuple):
    """What the first frame of a scene is tracked with."""

    tracker: Tracker
    state: TrackState
    cells: UInt8[Array, "camera rows columns 3"]
    capacities: Capacities


def first_step(scene: Scene, *overrides: str) -> FirstStep:
    """The tracker of a scene at its first frame, from the pose that is given."""
    config = scene.config(*overrides)
    clip = opened_clip(scene.recording, config)
    background, actors = learn_background(clip, config.images.background), Actors(tuple(scene.bodies))
    tracker = tracking_setup(clip, background, actors.bodies, config).tracker
    start = find_initial_pose(PoseRequest(clip, background, actors, config), SOURCES).pose
    cells, state = jnp.asarray(next(clip.frames()).cells), TrackState.from_pose(jnp.asarray(start))
    return FirstStep(tracker, state, cells, first_capacities(tracker, state, FrameInput(cells)))


def stage_quantities(scene: Scene) -> Iterator[Quantity]:
    """The stages of one step before the solver."""
    tracker, state, cells, capacities = first_step(scene)
    start = state.previous
    leaves = eqx.filter_jit(lambda reader, cells: reader.leaves(cells.astype(jnp.float32) / 255.0))
    views = eqx.filter_jit(lambda tracker, state, cells: tracker.views(FrameInput(cells), state, capacities)[0])
    near = eqx.filter_jit(
        lambda tracker, state, views: views.near(
            tracker.body.posed_blobs(state.previous), similarity_among(tracker.terms).exponent, capacities.blocks
        )
    )
    seen = views(tracker, state, cells)
    quadratic = eqx.filter_jit(lambda objective, pose: objective.quadratic(pose))
    judged = eqx.filter_jit(
        lambda tracker, state, views: tracker.judged(state.previous, state.baseline, views.windows, FrameInput(cells))
    )
    objective = FrameEnergy(tracker.body, seen, History.unknown(start), tracker.terms)
    objective = eqx.filter_jit(lambda energy, pose: energy.near(pose, capacities.blocks)[0])(objective, start)
    yield Quantity("stage", "quad-trees of 12 cameras", milliseconds(leaves, tracker.reader, cells), "ms")
    yield Quantity("stage", "with choice of blobs and colours", milliseconds(views, tracker, state, cells), "ms")
    yield Quantity("stage", "lists of near pairs", milliseconds(near, tracker, state, seen), "ms")
    yield Quantity("stage", "value, gradient and curvature", milliseconds(quadratic, objective, start), "ms")
    pairs = jnp.linspace(-10.0, 0.0, TILE * MEMBERS * int(near(tracker, state, seen)[1]), dtype=jnp.float32)
    yield Quantity("stage", "its exponentials alone", milliseconds(jax.jit(jnp.exp), pairs), "ms")
    if tracker.limbs is not None and tracker.reader.subject is not None:
        known = tracker.with_memory(state)
        yield Quantity("stage", "evidence for the limbs", milliseconds(judged, tracker, known, seen), "ms")


def end_to_end_quantities(scene: Scene) -> Iterator[Quantity]:
    """From the videos to the poses, against decoding alone, in turns."""
    decoding, whole = [], []
    for _ in range(3):
        decoding.append(decoding_rate(scene.recording, scene.frames))
        whole.append(scene.tracked().times.frames_per_second("whole", skipped=3))
    yield Quantity("end to end", "decoding alone", max(decoding), "frames/s", True)
    yield Quantity("end to end", "videos to poses", max(whole), "frames/s", True)
    yield Quantity("end to end", "share of the decode-only rate", max(whole) / max(decoding), "ratio", True, 0.8)
