"""The empty scene as a camera sees it, drawn once; and the grid of samples that pictures are averaged from."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sogjax.synth import light
from sogjax.synth.raster import Hits, Window, rasterize
from sogjax.synth.scene import Scene
from sogjax.synth.views import View

OVERSAMPLING = 2
"""Samples per pixel in each direction."""


@dataclass(frozen=True)
class Plate:
    """The empty scene in one camera: the light of its pixels, in two parts, and what they show (linear)."""

    ambient: Float[np.ndarray, "row column 3"]
    direct: Float[np.ndarray, "row column 3"]
    points: Float[np.ndarray, "row column 3"]
    props: Float[np.ndarray, "y x"] | None = None
    """Depth of the samples that show what stands among the people, infinite elsewhere; None where nothing does."""

    @property
    def total(self) -> Float[np.ndarray, "row column 3"]:
        """The picture without people."""
        return self.ambient + self.direct


def sample_pixels(view: View, points: Float[np.ndarray, "n 3"]) -> tuple[np.ndarray, np.ndarray]:
    """Projected points in the grid of samples, where integers are the samples' places, and depths."""
    pixels, depths = view.project(points)
    return (pixels + 0.5) * OVERSAMPLING - 0.5, depths


def averaged(samples: Float[np.ndarray, "row column channel"]) -> Float[np.ndarray, "r c channel"]:
    """Pixels from samples: the mean of each square of them."""
    n = OVERSAMPLING
    total = samples[::n, ::n].copy()
    for i in range(n * n):
        if i:
            total += samples[i // n :: n, i % n :: n]
    return total / np.float32(n * n)


def plate_of(scene: Scene, view: View) -> Plate:
    """Draw the empty scene."""
    window = Window(0, 0, view.width * OVERSAMPLING, view.height * OVERSAMPLING)
    pixels, depths = sample_pixels(view, scene.mesh.vertices)
    hits = rasterize(pixels, depths, scene.mesh.faces, window)
    vertices = np.concatenate([scene.mesh.vertices, scene.uv], 1, dtype=np.float32)
    values = hits.interpolated(vertices, scene.mesh.faces)
    normals = scene.mesh.normals[scene.mesh.faces[hits.faces, 0]].astype(np.float32)
    albedo = light.linear_from_srgb(scene.colors(hits.faces, values[:, 3:]))

    def image(samples: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "row column 3"]:
        filled = np.zeros((window.height, window.width, 3), np.float32)
        filled[hits.rows, hits.columns] = samples
        return filled

    # Where the shadows of the furniture fall is looked up once per pixel: they are softer than that anyway.
    points, upwards = (image(v)[::OVERSAMPLING, ::OVERSAMPLING] for v in (values[:, :3], normals))
    lit = scene.shadow.lit((points + np.float32(0.02) * upwards).reshape(-1, 3), taps=6)
    lamp = averaged(image(albedo * light.direct(normals))) * lit.reshape(view.height, view.width, 1)
    ambient = averaged(image(albedo * light.ambient(normals)))
    return Plate(ambient, lamp, np.ascontiguousarray(points), _depths_of_props(scene, hits, window))


def _depths_of_props(scene: Scene, hits: Hits, window: Window) -> Float[np.ndarray, "y x"] | None:
    if scene.props is None:
        return None
    seen = hits.where(scene.props[hits.faces])
    depths = np.full((window.height, window.width), np.inf)
    depths[seen.rows, seen.columns] = seen.depths
    return depths
