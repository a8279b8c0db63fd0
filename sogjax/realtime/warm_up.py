"""Compiling before anybody is in view: a frame is drawn in which the actors stand in the middle of the place."""

from collections.abc import Sequence

import cv2
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.model.body import Body
from sogjax.model.camera import project
from sogjax.realtime.following import Following
from sogjax.realtime.stepping import LiveStep
from sogjax.run.background import Background
from sogjax.run.clip_search import NUM_FOLLOWED
from sogjax.run.setup import Setup
from sogjax.run.terminal import alive
from sogjax.scene.background import stack_background
from sogjax.scene.cells import stack_shape
from sogjax.search.placed_body import centred
from sogjax.tracking.frame import FrameInput

GREY = 128
COVER = 1.2
"""Radius of a blob as it is drawn, in its sigmas."""


def drawn_frame(setup: Setup, background: Background) -> FrameInput:
    """What the cameras would see of the actors side by side in the middle of the place, roughly."""
    grids, bodies = setup.clip.grids, setup.bodies
    shape = stack_shape(grids)
    cells = np.full((len(grids), *shape, 3), GREY, np.uint8)
    if background.cameras is not None:
        cells = np.array(stack_background(background.cameras, grids).colors)
    for body, pose in zip(bodies, standing(setup), strict=True):
        _draw(cells, setup, body, pose)
    return FrameInput(cells, np.ones(len(grids), bool))


def standing(setup: Setup) -> list[Float[np.ndarray, "_dof"]]:
    """The actors' rest poses in the middle of the place, a metre apart."""
    middle = where_all_look(np.asarray(setup.tracker.cameras.camera_from_world, float))
    apart = np.eye(3)[0 if setup.clip.recording.up[-1] != "x" else 1]
    return [
        centred(body, np.asarray(body.poses["rest"])[None], middle + k * apart)[0].astype(np.float32)
        for k, body in enumerate(setup.bodies)
    ]


def where_all_look(camera_from_world: Float[np.ndarray, "camera 4 4"]) -> Float[np.ndarray, "3"]:
    """The point nearest to the axes of all cameras; metres, world."""
    turn = camera_from_world[:, :3, :3]
    centres = -np.einsum("cji,cj->ci", turn, camera_from_world[:, :3, 3])
    across = np.eye(3) - turn[:, 2, :, None] * turn[:, 2, None, :]
    weak = 1e-3 * np.eye(3)  # where all look the same way, near the cameras
    return np.linalg.solve(across.sum(axis=0) + weak, np.einsum("cij,cj->i", across, centres) + weak @ centres.mean(0))


def warm_up(following: Following, frame: FrameInput, poses: Sequence[Float[np.ndarray, "_dof"]]) -> None:
    """Compile all that is needed to find and to follow the actors, with a frame in which they stand in `poses`."""
    with alive("getting ready"):
        if following.search is not None:
            following.search.try_out([frame] * NUM_FOLLOWED)
        warm_up_step(following, frame, np.concatenate([*poses]))


def warm_up_step(following: Following, frame: FrameInput, pose: Float[np.ndarray | Array, "dof"]) -> None:
    """Compile the tracker's step, with a frame and a rough pose of it."""
    cells, step = np.asarray(frame.cells), following.step
    present = np.ones(len(cells), bool)
    moment = step.start(np.asarray(pose))
    for number in range(2):
        moment = step(moment, cells, present, float(number))[0]
    LiveStep(step.tracker, step.spare)(moment, cells, present, 2.0)
    if following.search is not None:
        following.search.step.capacities, following.search.step.spare = step.capacities, step.spare


def _draw(cells: np.ndarray, setup: Setup, body: Body, pose: Float[np.ndarray, "dof"]) -> None:
    """Draw a body's blobs over the cells of all cameras, the far ones first."""
    blobs = body.posed_blobs(jnp.asarray(pose))
    colors = np.rint(255.0 * np.asarray(body.blob_colors)).astype(int)
    for k, grid in enumerate(setup.clip.grids):
        camera = jax.tree.map(lambda leaf, k=k: leaf[k], setup.tracker.cameras)
        seen = project(camera, blobs)
        means, sigmas = np.asarray(seen.means) / grid.cell_size, np.asarray(seen.sigmas) / grid.cell_size
        picture = np.ascontiguousarray(cells[k])
        for blob in np.argsort(sigmas / np.maximum(np.asarray(body.blob_sigmas), 1e-6)):
            if np.isfinite(means[blob]).all() and np.abs(means[blob]).max() < 1e4:
                centre = (round(float(means[blob, 0])), round(float(means[blob, 1])))
                radius = max(round(COVER * float(sigmas[blob])), 1)
                cv2.circle(picture, centre, radius, tuple(map(int, colors[blob])), cv2.FILLED)
        cells[k] = picture
