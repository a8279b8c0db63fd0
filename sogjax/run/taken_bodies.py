"""Cameras whose learnt background took the body: where a pose is known they show its colours, and no foreground.

A body that something hides is no foreground either, but its colours are not seen there.
"""

from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.model.compiled import compiled_hastily
from sogjax.quality.verdict import usual_overlaps, worse_cameras
from sogjax.run.setup import Setup
from sogjax.scene.background import BackgroundImage
from sogjax.tracking.frame import FrameInput, TrackState, on_device
from sogjax.tracking.tracker import Tracker

AS_WELL = 0.6
"""Part of what cameras usually show of the body's colours, from which on one sees the body."""


def cameras_that_took_bodies(
    setup: Setup, background: Sequence[BackgroundImage], known: Mapping[int, Float[np.ndarray, "dof"]]
) -> list[str]:
    """The cameras whose background, learnt from the clip, took a body; poses are `known` of some frames.

    Raises:
        InputError: a video cannot be read.
    """
    tracker, names = setup.tracker, setup.clip.recording.rig.names
    if tracker.limbs is None or tracker.reader.subject is None:
        return []
    overlaps, shown = [], []
    for number, pose in known.items():
        frame = on_device(next(iter(setup.clip.frames(number, number + 1))))
        overlap, colors = _seen(tracker, frame, jnp.asarray(pose, tracker.body.blob_sigmas.dtype))
        overlaps.append(np.asarray(overlap, float))
        shown.append(np.asarray(colors, float))
    learnt = [name for name, own in zip(names, background, strict=True) if own.origin == "clip"]
    taken = that_see_no_foreground(names, np.concatenate(overlaps), np.stack(shown))
    return [name for name in taken if name in learnt]


def that_see_no_foreground(
    names: Sequence[str], overlap: Float[np.ndarray, "silhouette camera"], colors: Float[np.ndarray, "frame camera"]
) -> list[str]:
    """Cameras that show the body's colours about as well as most, but much less foreground there.

    Args:
        names: of the cameras.
        overlap: of silhouettes and foreground (IoU); NaN where too little is known.
        colors: part of the body that shows its colours.
    """
    shown = dict(zip(names, np.median(colors, axis=0).tolist(), strict=True))
    least = AS_WELL * float(np.median([*shown.values()]))
    return [name for name in worse_cameras(usual_overlaps(names, overlap)) if shown[name] >= least]


@compiled_hastily
def _seen(
    tracker: Tracker, frame: FrameInput, pose: Float[Array, "dof"]
) -> tuple[Float[Array, "actor camera"], Float[Array, "camera"]]:
    """How far silhouettes are foreground (IoU), and what part of the body shows its colours, background or not."""
    state = tracker.with_memory(TrackState.from_pose(pose))
    assert state.baseline is not None
    baseline, count = state.baseline, len(tracker.normalizers)
    overlap = tracker.judged(pose, baseline, tracker.windows(frame, state), frame).overlap
    present = jnp.ones(count, bool) if frame.present is None else jnp.asarray(frame.present)
    alone = jnp.eye(count, dtype=bool) & present[None]
    shown = jax.lax.map(lambda one: tracker.judged(pose, baseline, None, FrameInput(frame.cells, one)).explained, alone)
    assert overlap is not None
    return overlap, jnp.mean(shown, axis=1)
