"""The empty scene and people in front of it, as a camera sees them: pictures are averages of samples."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from sogjax.synth import light
from sogjax.synth.figure import Figure, Mesh
from sogjax.synth.raster import Hits, Window, rasterize
from sogjax.synth.rotations import unit
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

    @cached_property
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
    albedo = light.linear_from_srgb(scene.colors(hits.faces, values[:, 3:]))
    normals = scene.mesh.normals[scene.mesh.faces[:, 0]].astype(np.float32)  # of faces, which are flat
    of_samples = lambda of_faces: np.take(of_faces, hits.faces, axis=0)

    def image(samples: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "row column 3"]:
        if len(samples) == window.height * window.width:
            return samples.reshape(window.height, window.width, 3)
        filled = np.zeros((window.height, window.width, 3), np.float32)
        filled[hits.rows, hits.columns] = samples
        return filled

    # Where the shadows of the furniture fall is looked up once per pixel: they are softer than that anyway.
    points, upwards = (image(v)[::OVERSAMPLING, ::OVERSAMPLING] for v in (values[:, :3], of_samples(normals)))
    lit = scene.shadow.lit((points + np.float32(0.02) * upwards).reshape(-1, 3), taps=6)
    lamp = averaged(image(albedo * of_samples(light.direct(normals)))) * lit.reshape(view.height, view.width, 1)
    ambient = averaged(image(albedo * of_samples(light.ambient(normals))))
    return Plate(ambient, lamp, np.ascontiguousarray(points), _depths_of_props(scene, hits, window))


def _depths_of_props(scene: Scene, hits: Hits, window: Window) -> Float[np.ndarray, "y x"] | None:
    if scene.props is None:
        return None
    seen = hits.where(scene.props[hits.faces])
    depths = np.full((window.height, window.width), np.inf)
    depths[seen.rows, seen.columns] = seen.depths
    return depths


_CONTACT = 0.25
"""Metres around people within which they take away light from above."""
_LEAST_AMBIENT = 0.45


@dataclass(frozen=True)
class Shadows:
    """Where people in one frame take light away: the lamp's, and the light from above near their feet."""

    lamp: light.ShadowMap
    above: light.ShadowMap
    scene: light.ShadowMap | None = None
    """The shadows that what stands among the people throws on them."""

    @classmethod
    def of(cls, meshes: Sequence[Mesh], scene: light.ShadowMap | None = None) -> "Shadows":
        """Shadows of people, and on people those of the scene."""
        wide = light.ShadowMap.of(meshes, light.UP, spacing=0.03, spread=0.22, bias=0.02)
        return cls(light.ShadowMap.of(meshes), wide, scene)

    def lit(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        """Share of the lamp's light that reaches points on people."""
        share = self.lamp.lit(points)
        return share if self.scene is None else share * self.scene.lit(points, taps=6)


@dataclass(frozen=True)
class Shot:
    """A picture with people in it."""

    light: Float[np.ndarray, "row column 3"]
    """Linear."""
    coverage: Float[np.ndarray, "row column"]
    """Share of each pixel that shows people."""
    changed: Window
    """Outside of it, the picture is the empty scene's."""

    @property
    def mask(self) -> Bool[np.ndarray, "row column"]:
        """The pixels that show people by at least a half."""
        return self.coverage >= 0.5


def shot_of(
    view: View, plate: Plate, people: Sequence[Figure], meshes: Sequence[Mesh], shadows: Shadows | None
) -> Shot:
    """Draw people into the empty scene, behind what stands in front of them."""
    picture = plate.total.copy()
    coverage = np.zeros(picture.shape[:2], np.float32)
    changed = Window(0, 0, 0, 0) if shadows is None else _darken(picture, view, plate, meshes, shadows)
    colors, covered, window = _people_samples(view, plate, people, meshes, shadows)
    if window.width and window.height:
        small = Window(*(value // OVERSAMPLING for value in (window.x, window.y, window.width, window.height)))
        share = averaged(covered)[..., 0]
        picture[small.slices] = picture[small.slices] * (1.0 - share)[..., None] + averaged(colors)
        coverage[small.slices] = share
        changed = changed.joined(small)
    return Shot(picture, coverage, changed)


def _people_samples(
    view: View, plate: Plate, people: Sequence[Figure], meshes: Sequence[Mesh], shadows: Shadows | None
) -> tuple[np.ndarray, np.ndarray, Window]:
    """Light and coverage of the samples of the smallest window that holds all people."""
    limit = Window(0, 0, view.width * OVERSAMPLING, view.height * OVERSAMPLING)
    projected = [sample_pixels(view, mesh.vertices) for mesh in meshes]
    visible = np.concatenate([pixels[depths > 0.0] for pixels, depths in projected])
    window = Window.around(visible, limit) if len(visible) else Window(0, 0, 0, 0)
    colors = np.zeros((window.height, window.width, 3), np.float32)
    covered = np.zeros((window.height, window.width, 1), np.float32)
    empty = np.full((window.height, window.width), np.inf)
    nearest = empty if plate.props is None else plate.props[window.slices].copy()
    for figure, mesh, (pixels, depths) in zip(people, meshes, projected, strict=True):
        hits = rasterize(pixels, depths, mesh.faces, window)
        front = hits.depths < nearest[hits.rows, hits.columns]
        hits = hits if front.all() else hits.where(front)
        nearest[hits.rows, hits.columns] = hits.depths
        colors[hits.rows, hits.columns] = _shaded(figure, mesh, hits, shadows)
        covered[hits.rows, hits.columns] = 1.0
    return colors, covered, window


def _shaded(figure: Figure, mesh: Mesh, hits: Hits, shadows: Shadows | None) -> Float[np.ndarray, "n 3"]:
    """Light that the person sends to the camera from the places seen."""
    attributes = np.concatenate([mesh.vertices, mesh.normals, figure.rest], 1, dtype=np.float32)
    values = hits.interpolated(attributes, mesh.faces)
    points, normals, rest = values[:, :3], unit(values[:, 3:6]), values[:, 6:]
    albedo = light.linear_from_srgb(figure.wardrobe.colors(figure.face_part[hits.faces], rest))
    lamp = light.direct(normals)
    if shadows is not None:
        lamp = lamp * shadows.lit(points + np.float32(0.02) * normals)[:, None]
    return albedo * (light.ambient(normals) + lamp)


def _darken(
    picture: Float[np.ndarray, "row column 3"],
    view: View,
    plate: Plate,
    meshes: Sequence[Mesh],
    shadows: Shadows,
) -> Window:
    """Take away from the empty scene the light that the people stop, and say where."""
    bodies = np.concatenate([mesh.vertices for mesh in meshes])
    on_floor = bodies - bodies[:, 2:] / light.LAMP[2] * light.LAMP
    around = _CONTACT * np.array([[1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]])
    swept = np.concatenate([bodies, on_floor, (on_floor[None, ::7] + around[:, None]).reshape(-1, 3)])
    pixels, depths = view.project(swept)
    visible = pixels[depths > 0.0]
    limit = Window(0, 0, view.width, view.height)
    window = Window.around(visible, limit, even=False) if len(visible) else Window(0, 0, 0, 0)
    rows, columns = window.slices
    points = plate.points[rows, columns].reshape(-1, 3)
    lower, upper = swept.min(0) - _CONTACT, swept.max(0) + _CONTACT
    within = [(points[:, k] > lower[k]) & (points[:, k] < upper[k]) for k in range(2)]
    near = np.flatnonzero(within[0] & within[1])
    lit, open_above = np.ones(len(points), np.float32), np.ones(len(points), np.float32)
    lit[near] = shadows.lamp.lit(points[near])
    open_above[near] = shadows.above.lit(points[near], taps=12)
    shape = (window.height, window.width, 1)
    left = _LEAST_AMBIENT + (1.0 - _LEAST_AMBIENT) * open_above.reshape(shape)
    picture[rows, columns] = plate.ambient[rows, columns] * left + plate.direct[rows, columns] * lit.reshape(shape)
    return window
