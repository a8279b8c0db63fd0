"""What the cameras of a stage see of the people's keypoints: where they are in the pictures, and whether hidden."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Bool, Float

from sogjax.synth.detector import Sight
from sogjax.synth.figure import Mesh
from sogjax.synth.landmarks import keypoint_points
from sogjax.synth.raster import Window, rasterize
from sogjax.synth.scene import merged
from sogjax.synth.stage import Stage
from sogjax.synth.views import View

_COARSE = 4
"""Pixels of a picture that are one of the depth map's."""
_BEHIND = 0.13
"""Metres by which a surface must lie before a keypoint to hide it: its own flesh does not."""


def sights(stage: Stage, frame: int, shifts: Float[np.ndarray, "person keypoint 3"]) -> Iterator[Sight]:
    """By camera what it sees in a frame of keypoints that are shifted in their joints' frames, metres."""
    placed = [*zip(stage.people, stage.poses(frame), strict=True)]
    shifted = zip(placed, shifts, strict=True)
    points = np.stack([keypoint_points(person.figure.anatomy, pose, shift) for (person, pose), shift in shifted])
    statures = np.array([person.figure.anatomy.stature for person in stage.people])
    meshes = [person.figure.posed(pose) for person, pose in placed]
    props = stage.scene.props
    if props is not None:
        room = stage.scene.mesh
        meshes.append(Mesh(room.vertices, room.normals, room.faces[props]))
    surface = merged(meshes)
    for view in stage.views:
        yield _sight(view, points, statures, surface)


def _sight(view: View, points: Float[np.ndarray, "person keypoint 3"], statures: np.ndarray, surface: Mesh) -> Sight:
    pixels, depths = view.project(points.reshape(-1, 3))
    size = np.array([view.width, view.height])
    inside = (depths > 0.1) & (pixels >= -0.5).all(1) & (pixels < size - 0.5).all(1)
    hidden = inside & _hidden(view, pixels, depths, surface)
    shape = points.shape[:2]
    heights = view.matrix[1, 1] * statures / np.maximum(depths.reshape(shape).mean(1), 0.1)
    return Sight(pixels.reshape(*shape, 2), inside.reshape(shape), hidden.reshape(shape), heights)


def _hidden(
    view: View, pixels: Float[np.ndarray, "n 2"], depths: Float[np.ndarray, "n"], surface: Mesh
) -> Bool[np.ndarray, "n"]:
    window = Window(0, 0, -(-view.width // _COARSE), -(-view.height // _COARSE))
    corners, corner_depths = view.project(surface.vertices)
    hits = rasterize((corners - (_COARSE - 1) / 2.0) / _COARSE, corner_depths, surface.faces, window)
    nearest = np.full((window.height, window.width), np.inf)
    nearest[hits.rows, hits.columns] = hits.depths
    column, row = np.clip(np.nan_to_num(pixels / _COARSE).astype(int), 0, [window.width - 1, window.height - 1]).T
    return nearest[row, column] < depths - _BEHIND
