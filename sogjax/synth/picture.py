"""People in front of the empty scene, as a camera sees them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from sogjax.synth import light
from sogjax.synth.clothes import Wardrobe
from sogjax.synth.figure import Figure, Mesh
from sogjax.synth.plate import OVERSAMPLING, Plate, averaged, sample_pixels
from sogjax.synth.raster import Hits, Window, rasterize
from sogjax.synth.rotations import unit
from sogjax.synth.views import View

_CONTACT = 0.25
"""Metres around people within which they take away light from above."""
_LEAST_AMBIENT = 0.45


@dataclass(frozen=True)
class Person:
    """A person to draw, with clothes fitted."""

    figure: Figure
    wardrobe: Wardrobe

    @classmethod
    def dressed(cls, figure: Figure) -> "Person":
        """Fit the clothes of a figure."""
        return cls(figure, Wardrobe.fitted(figure.outfit, figure.anatomy))


@dataclass(frozen=True)
class Shadows:
    """Where people in one frame take light away: the lamp's, and the light from above near their feet."""

    lamp: light.ShadowMap
    above: light.ShadowMap
    scene: light.ShadowMap | None = None
    """Of what stands among the people and throws shadows on them."""

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


def shot_of(
    view: View, plate: Plate, people: Sequence[Person], meshes: Sequence[Mesh], shadows: Shadows | None
) -> Shot:
    """Draw people into the empty scene, behind what stands in front of them."""
    picture = plate.total
    coverage = np.zeros(picture.shape[:2], np.float32)
    if shadows is not None:
        _darken(picture, view, plate, meshes, shadows)
    colors, covered, window = _people_samples(view, plate, people, meshes, shadows)
    if window.width and window.height:
        small = Window(*(value // OVERSAMPLING for value in (window.x, window.y, window.width, window.height)))
        share = averaged(covered)[..., 0]
        picture[small.slices] = picture[small.slices] * (1.0 - share)[..., None] + averaged(colors)
        coverage[small.slices] = share
    return Shot(picture, coverage)


def _people_samples(
    view: View, plate: Plate, people: Sequence[Person], meshes: Sequence[Mesh], shadows: Shadows | None
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
    for person, mesh, (pixels, depths) in zip(people, meshes, projected, strict=True):
        hits = rasterize(pixels, depths, mesh.faces, window)
        front = hits.depths < nearest[hits.rows, hits.columns]
        hits = hits.where(front)
        nearest[hits.rows, hits.columns] = hits.depths
        colors[hits.rows, hits.columns] = _shaded(person, mesh, hits, shadows)
        covered[hits.rows, hits.columns] = 1.0
    return colors, covered, window


def _shaded(person: Person, mesh: Mesh, hits: Hits, shadows: Shadows | None) -> Float[np.ndarray, "n 3"]:
    """Light that the person sends to the camera from the places seen."""
    figure = person.figure
    attributes = np.concatenate([mesh.vertices, mesh.normals, figure.rest], 1, dtype=np.float32)
    values = hits.interpolated(attributes, mesh.faces)
    points, normals, rest = values[:, :3], unit(values[:, 3:6]), values[:, 6:]
    albedo = light.linear_from_srgb(person.wardrobe.colors(figure.face_part[hits.faces], rest))
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
) -> None:
    """Take away from the empty scene the light that the people stop."""
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


def mask_of(shot: Shot) -> Bool[np.ndarray, "row column"]:
    """The pixels that show people by at least a half."""
    return shot.coverage >= 0.5
