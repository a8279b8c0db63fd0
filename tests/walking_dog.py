"""A dog that walks on before five cameras, whose limbs are judged while it is tracked."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
from body_cases import shipped
from drawn_scene import cells_of, draw, in_colors, make_tracker, standing
from rig_cases import ring_rig

from sogjax.model.solid import Solid
from sogjax.quality.limb_evidence import LimbBlobs
from sogjax.scene.foreground import subject_colors
from sogjax.search.other_pass import Pass
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.tracking.frame_by_frame import track

DEPTH = 6
FRAMES = 12
HEIGHT = 1.1
STEP = 0.004


def judging_tracker(body, rig):
    """A tracker that knows a body's colours, and judges its limbs."""
    table = subject_colors(np.asarray(body.blob_colors), np.asarray(body.blob_sigmas) ** 2)
    tracker = make_tracker(body, rig, DEPTH, solver=GaussNewton())
    reader = replace(tracker.reader, subject=jnp.asarray(table, jnp.float32))
    return replace(tracker, reader=reader, limbs=LimbBlobs.from_body(body), solid=Solid.of(body), pairs="sparse")


def pass_of(frames):
    """The pass of some frames, whose limbs were judged."""
    column = lambda values: np.stack([np.asarray(value) for value in values])
    return Pass(
        column(frame.result.pose for frame in frames),
        column(frame.result.limbs.error_probability for frame in frames),
        column(frame.result.limbs.baseline for frame in frames),
        np.array([float(frame.result.energy) for frame in frames]),
        frames[-1].capacities,
    )


def walking():
    """The tracker, the cells of all frames, and what it found in them."""
    body, rig = in_colors(shipped("dog")), ring_rig(5, (160, 120), distance=1.6)
    tracker = judging_tracker(body, rig)
    poses = np.stack([np.asarray(standing(body, HEIGHT))] * FRAMES)
    poses[:, 0] += STEP * np.arange(FRAMES)
    cells = [cells_of(rig, draw(body, jnp.asarray(pose), rig), DEPTH) for pose in poses]
    return tracker, cells, pass_of([*track(tracker, jnp.asarray(poses[0]), cells)])
