"""Adjusting cameras: moves that gain clearly are freed, the clip is climbed again, and what then does not is undone."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from sogjax.refine.camera_choice import CamerasModel, Part, free_moves
from sogjax.refine.camera_moves import MOVE
from sogjax.refine.climb import LEAST_DAMPING, Climbed, climbed
from sogjax.refine.clip_energy import ClipEnergy

ROUNDS = 6
"""Rounds of freeing and undoing, at most."""


@dataclass(frozen=True)
class FoundCameras:
    """Where cameras are, and when."""

    climbed: Climbed
    """What was climbed, with the cameras' moves behind the shape parameters."""
    moves: Float[np.ndarray, "camera 7"]
    shares: dict[Part, float]
    """What is believed, and what each is worth as a share of what its camera could gain at most."""


def found_cameras(
    energy: ClipEnergy,
    poses: Float[np.ndarray, "frame dof"],
    params: Float[np.ndarray, "shared"],
    with_shape: bool,
    names: tuple[str, ...],
    report: Callable[[str], None] = lambda _: None,
) -> FoundCameras | None:
    """Moves of cameras that explain the clip clearly better; None: there are none.

    `poses` and `params` (shape, then moves) are those of highest energy with the cameras as they are; `names` are the
    parts of a move that are in question (turn, place, time). After each round `report` is told what is free.
    """
    shape = energy.shape.num_params
    cameras = (energy.num_shared - shape) // MOVE
    of_shape = np.full(shape, with_shape)
    start, found = (poses, params), None
    in_question = [Part(camera, name) for camera in range(cameras) for name in names]
    free: list[Part] = []
    undone: list[Part] = []
    for _ in range(ROUNDS):
        energy = energy.near(poses, params)
        model = cameras_model(energy, poses, params, of_shape)
        doubtful = model.doubtful(free)
        more = [] if doubtful else model.newly_told(free, in_question, undone)
        if not doubtful and not more:
            break
        undone += doubtful
        in_question = [part for part in in_question if part not in doubtful]
        free = [part for part in free if part not in doubtful] + more
        params = _undone(params, start[1], doubtful, shape)
        found = climbed(energy, poses, params, np.concatenate([of_shape, free_moves(free, cameras)]), tracked=start)
        poses, params = found.poses, found.params
        report(", ".join(f"{part.name} of camera {part.camera + 1}" for part in free) or "none")
    if found is None or not free:
        return None
    shares = cameras_model(energy.near(poses, params), poses, params, of_shape).shares(free)
    return FoundCameras(found, energy.moves(params), shares)


def cameras_model(
    energy: ClipEnergy,
    poses: Float[np.ndarray, "frame dof"],
    params: Float[np.ndarray, "shared"],
    of_shape: Bool[np.ndarray, "shape"],
) -> CamerasModel:
    """What the moves of the cameras are worth when the poses, and the shape where it may change, follow them."""
    _, system, (scale, _) = energy.model(poses, params)
    gradient, curvature = system.of_shared(LEAST_DAMPING * (scale + scale.mean(axis=1, keepdims=True)))
    shape = np.flatnonzero(of_shape)
    count = len(of_shape)
    own, across = curvature[count:, count:], curvature[np.ix_(shape, np.arange(count, len(curvature)))]
    along = np.linalg.solve(curvature[np.ix_(shape, shape)], np.column_stack([gradient[shape], across]))
    return CamerasModel(
        gradient[count:] - across.T @ along[:, 0],
        own - across.T @ along[:, 1:],
        params[count:],
        energy.most(poses, params),
    )


def _undone(
    params: Float[np.ndarray, "shared"], start: Float[np.ndarray, "shared"], parts: list[Part], shape: int
) -> Float[np.ndarray, "shared"]:
    """The parameters with some moves as they were at the start."""
    back = np.concatenate([np.zeros(shape, bool), free_moves(parts, (len(params) - shape) // MOVE)])
    return np.where(back, start, params)
