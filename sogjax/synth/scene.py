"""The room: floor, walls, furniture and posters as textured panels."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from sogjax.synth.figure import Mesh
from sogjax.synth.light import ShadowMap
from sogjax.synth.textures import Rgb, Texture

_CELL = 0.3
"""Panels are cut into pieces of at most this size, so that none reaches behind a camera that sees it."""
_WALLS = (-5.6, 5.9, -5.8, 5.5, 3.3)
"""x from, x to, y from, y to, height."""

_FURNITURE: tuple[Rgb, ...] = (
    (0.60, 0.22, 0.20),
    (0.25, 0.36, 0.55),
    (0.72, 0.60, 0.30),
    (0.33, 0.47, 0.33),
    (0.78, 0.74, 0.66),
    (0.30, 0.28, 0.27),
    (0.52, 0.38, 0.26),
    (0.80, 0.64, 0.52),
    (0.46, 0.44, 0.58),
)


@dataclass(frozen=True)
class Panel:
    """A flat rectangle; seen from the side its normal (u x v) points to."""

    corner: Float[np.ndarray, "3"]
    u: Float[np.ndarray, "3"]
    v: Float[np.ndarray, "3"]
    """Edges from the corner, metres."""
    texture: Texture
    casts_shadow: bool = True

    def mesh(self) -> tuple[Mesh, Float[np.ndarray, "vertex 2"]]:
        """The panel in pieces, and the surface coordinates of the vertices."""
        length_u, length_v = np.linalg.norm(self.u), np.linalg.norm(self.v)
        count_u, count_v = max(int(np.ceil(length_u / _CELL)), 1), max(int(np.ceil(length_v / _CELL)), 1)
        a, b = np.meshgrid(np.linspace(0, 1, count_u + 1), np.linspace(0, 1, count_v + 1), indexing="ij")
        a, b = a.ravel()[:, None], b.ravel()[:, None]
        normal = np.cross(self.u, self.v) / (length_u * length_v)
        vertices = self.corner + a * self.u + b * self.v
        number = np.arange((count_u + 1) * (count_v + 1)).reshape(count_u + 1, count_v + 1)
        p, q = number[:-1, :-1].ravel(), number[1:, :-1].ravel()
        r, s = number[1:, 1:].ravel(), number[:-1, 1:].ravel()
        faces = np.concatenate([np.stack([p, q, r], 1), np.stack([p, r, s], 1)])
        mesh = Mesh(vertices, np.tile(normal, (len(vertices), 1)), faces)
        return mesh, np.concatenate([a * length_u, b * length_v], 1)


@dataclass(frozen=True)
class Scene:
    """All panels as one mesh."""

    mesh: Mesh
    uv: Float[np.ndarray, "vertex 2"]
    face_texture: Int[np.ndarray, "face"]
    textures: tuple[Texture, ...]
    shadow: ShadowMap
    """Of everything but floor, walls and ceiling."""

    def colors(self, faces: Int[np.ndarray, "n"], uv: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 3"]:
        """SRGB colours at surface coordinates of faces."""
        kind = self.face_texture[faces]
        order = np.argsort(kind, kind="stable")
        bounds = np.searchsorted(kind[order], np.arange(len(self.textures) + 1))
        colors = np.zeros((len(faces), 3), np.float32)
        for k, texture in enumerate(self.textures):
            chosen = order[bounds[k] : bounds[k + 1]]
            if len(chosen):
                colors[chosen] = texture(uv[chosen])
        return colors


def cluttered_room(rng: np.random.Generator) -> Scene:
    """A room with furniture along its walls, a few low things inside, and posters."""
    panels = [*_shell(rng), *_posters(rng)]
    for angle in np.deg2rad(np.arange(0, 360, 24) + rng.uniform(-6, 6, 15)):
        panels += _standing_thing(angle, rng)
    for angle in np.deg2rad(rng.uniform(0, 90) + np.array([0, 95, 200, 275])):
        size = rng.uniform([0.3, 0.3, 0.18], [0.5, 0.6, 0.36])
        panels += _box(2.75 * _direction(angle), size, rng.uniform(0, 3), _cover(rng))
    return _assembled(panels)


def _assembled(panels: Sequence[Panel]) -> Scene:
    parts = [panel.mesh() for panel in panels]
    number = np.concatenate([np.full(len(mesh.faces), k) for k, (mesh, _) in enumerate(parts)])
    casters = [mesh for panel, (mesh, _) in zip(panels, parts, strict=True) if panel.casts_shadow]
    return Scene(
        mesh=merged([mesh for mesh, _ in parts]),
        uv=np.concatenate([uv for _, uv in parts]),
        face_texture=number,
        textures=tuple(panel.texture for panel in panels),
        shadow=ShadowMap.of([merged(casters)], spacing=0.02, spread=0.05, bias=0.05),
    )


def merged(meshes: Sequence[Mesh]) -> Mesh:
    """Several meshes as one."""
    first = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, first[:-1], strict=True)]),
    )


def _direction(angle: float) -> Float[np.ndarray, "3"]:
    return np.array([np.cos(angle), np.sin(angle), 0.0])


def _shell(rng: np.random.Generator) -> list[Panel]:
    x0, x1, y0, y1, top = _WALLS
    x, y, z = np.array([x1 - x0, 0, 0]), np.array([0, y1 - y0, 0]), np.array([0, 0, top])
    seed = int(rng.integers(1 << 30))
    planks = Texture("planks", ((0.50, 0.40, 0.30), (0.62, 0.52, 0.40)), 0.14, seed)
    paint = Texture("wall", ((0.72, 0.71, 0.66), (0.50, 0.56, 0.58), (0.35, 0.30, 0.26)), 1.0, seed + 1)
    bricks = Texture("bricks", ((0.52, 0.34, 0.27), (0.64, 0.44, 0.34), (0.62, 0.60, 0.56)), 0.24, seed + 2)
    ceiling = Texture("checks", ((0.86, 0.86, 0.84), (0.82, 0.82, 0.80)), 0.6, seed + 3)
    return [
        Panel(np.array([x0, y0, 0.0]), x, y, planks, False),
        Panel(np.array([x0, y0, top]), y, x, ceiling, False),
        Panel(np.array([x1, y0, 0.0]), -x, z, paint, False),
        Panel(np.array([x0, y1, 0.0]), x, z, paint, False),
        Panel(np.array([x0, y0, 0.0]), y, z, bricks, False),
        Panel(np.array([x1, y1, 0.0]), -y, z, paint, False),
    ]


def _posters(rng: np.random.Generator) -> list[Panel]:
    x0, x1, y0, y1, _ = _WALLS
    panels = []
    for wall in range(4):
        for along in (-3.4, -1.2, 0.9, 3.2):
            size = rng.uniform([0.7, 0.8], [1.3, 1.2])
            height = rng.uniform(1.15, 1.6)
            shift = along + rng.uniform(-0.3, 0.3)
            corner, u = {
                0: (np.array([shift, y0 + 0.015, height]), np.array([-1.0, 0, 0])),
                1: (np.array([shift, y1 - 0.015, height]), np.array([1.0, 0, 0])),
                2: (np.array([x0 + 0.015, shift, height]), np.array([0, 1.0, 0])),
                3: (np.array([x1 - 0.015, shift, height]), np.array([0, -1.0, 0])),
            }[wall]
            colors = tuple(_FURNITURE[k] for k in rng.permutation(len(_FURNITURE))[:5])
            texture = Texture("poster", colors, float(size.max()), int(rng.integers(1 << 30)))
            panels.append(Panel(corner, size[0] * u, np.array([0, 0, size[1]]), texture, False))
    return panels


def _cover(rng: np.random.Generator) -> Texture:
    """A texture for a piece of furniture."""
    first, second, third = (_FURNITURE[k] for k in rng.permutation(len(_FURNITURE))[:3])
    kind = str(rng.choice(["plain", "plain", "stripes", "checks", "planks"]))
    return Texture(kind, (first, second, third), float(rng.uniform(0.08, 0.3)), int(rng.integers(1 << 30)))


def _standing_thing(angle: float, rng: np.random.Generator) -> list[Panel]:
    """Something that stands near the wall: a cupboard, a shelf with books, a barrel or a stack of boxes."""
    place = rng.uniform(4.75, 5.1) * _direction(angle)
    facing = angle + np.pi / 2 + rng.uniform(-0.25, 0.25)
    kind = int(rng.integers(4))
    if kind == 0:
        return _box(place, rng.uniform([0.8, 0.35, 0.7], [1.2, 0.5, 1.3]), facing, _cover(rng))
    if kind == 1:
        colors = (_FURNITURE[6], *(_FURNITURE[k] for k in rng.permutation(6)))
        return _box(place, rng.uniform([0.8, 0.3, 1.3], [1.1, 0.35, 2.0]), facing, Texture("shelf", colors, 0.33))
    if kind == 2:
        return _barrel(place, float(rng.uniform(0.22, 0.32)), float(rng.uniform(0.6, 1.0)), _cover(rng))
    lower = rng.uniform([0.5, 0.4, 0.35], [0.8, 0.6, 0.6])
    upper = lower * rng.uniform(0.6, 0.9, 3)
    stacked = place + np.array([0.0, 0.0, lower[2]])
    return _box(place, lower, facing, _cover(rng)) + _box(stacked, upper, facing + 0.4, _cover(rng))


def _box(place: Float[np.ndarray, "3"], size: Float[np.ndarray, "3"], turn: float, texture: Texture) -> list[Panel]:
    """A box without bottom whose footprint is centred at `place`."""
    u, v = size[0] * _direction(turn), size[1] * _direction(turn + np.pi / 2)
    z = np.array([0.0, 0.0, size[2]])
    a, b, c, d = place - (u + v) / 2, place + (u - v) / 2, place + (u + v) / 2, place + (v - u) / 2
    sides = [(a, u, z), (b, v, z), (c, -u, z), (d, -v, z), (a + z, u, v)]
    return [Panel(corner, first, second, texture) for corner, first, second in sides]


def _barrel(place: Float[np.ndarray, "3"], radius: float, height: float, texture: Texture) -> list[Panel]:
    """A tub with twelve sides and a lid."""
    angles = np.linspace(0, 2 * np.pi, 13)
    rim = [place + radius * _direction(angle) for angle in angles]
    z = np.array([0.0, 0.0, height])
    sides = [Panel(a, b - a, z, texture) for a, b in pairwise(rim)]
    half = radius * 0.70
    lid = _box(place + z * 0.98, np.array([2 * half, 2 * half, 0.02 * height + 0.01]), 0.3, texture)
    return sides + lid
