"""What stands in the room, as textured panels, and all of it as one mesh.

Textures are procedural: sRGB colours as functions of a surface's own coordinates in metres.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.synth.figure import Mesh
from sogjax.synth.light import ShadowMap

Colors = Float[np.ndarray, "n 3"]
Coordinates = Float[np.ndarray, "n 2"]
Palette = Float[np.ndarray, "color 3"]
Rgb = tuple[float, float, float]


@dataclass(frozen=True)
class Texture:
    """A kind of texture with its colours."""

    kind: str
    colors: tuple[Rgb, ...]
    period: float = 0.3
    """Metres."""
    seed: int = 0

    def __call__(self, uv: Coordinates) -> Colors:
        """Colours at surface coordinates (metres)."""
        uv, palette = uv.astype(np.float32), np.array(self.colors, np.float32)
        base = _KINDS[self.kind](uv, palette, self.period, self.seed)
        grain = 0.07 * (value_noise(uv / 0.05, self.seed) - 0.5) + 0.09 * (value_noise(uv / 0.6, self.seed + 1) - 0.5)
        return np.clip(base * (1.0 + grain[:, None]), 0.0, 1.0).astype(np.float32)


def value_noise(uv: Coordinates, seed: int) -> Float[np.ndarray, "n"]:
    """Smooth random values in 0..1 on a lattice of unit spacing."""
    lattice = np.random.default_rng([seed, 977]).random((256, 256), np.float32)
    whole = np.floor(uv)
    share, cell = uv.astype(float) - whole, whole.astype(np.int32)
    share = share * share * (3.0 - 2.0 * share)
    x0, y0 = cell[:, 0] & 255, cell[:, 1] & 255
    x1, y1 = (x0 + 1) & 255, (y0 + 1) & 255
    along, across = np.ascontiguousarray(share.T)
    at = lambda x, y: np.take(lattice, 256 * x + y, mode="clip")
    first, second = at(x0, y0), at(x0, y1)
    top = first + along * (at(x1, y0) - first)
    bottom = second + along * (at(x1, y1) - second)
    return top + across * (bottom - top)


def _plain(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    return np.broadcast_to(palette[0], (len(uv), 3))


def _planks(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    row = np.floor(uv[:, 1] / period).astype(int)
    rng = np.random.default_rng([seed, 3])
    shift = rng.random(512)[row % 512] * 2.0
    board = np.floor((uv[:, 0] + shift) / 1.4).astype(int)
    tone = rng.random(4096)[(row * 37 + board * 101) % 4096]
    colors = palette[0] + tone[:, None] * (palette[1] - palette[0])
    fibre = value_noise(np.stack([uv[:, 0] / 0.35, uv[:, 1] / 0.018], 1), seed)
    gap = (np.mod(uv[:, 1], period) < 0.006) | (np.mod(uv[:, 0] + shift, 1.4) < 0.006)
    return colors * (0.92 + 0.12 * fibre)[:, None] * np.where(gap, 0.6, 1.0)[:, None]


def _checks(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    odd = np.mod(np.floor(uv / period).sum(1), 2.0).astype(int)
    return palette[odd]


def _stripes(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    return palette[np.floor(uv[:, 0] / period).astype(int) % len(palette)]


def _bricks(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    row = np.floor(uv[:, 1] / (0.4 * period)).astype(int)
    u = uv[:, 0] + 0.5 * period * (row % 2)
    brick = np.floor(u / period).astype(int)
    tone = np.random.default_rng([seed, 5]).random(4096)[(row * 53 + brick * 17) % 4096]
    colors = palette[0] + tone[:, None] * (palette[1] - palette[0])
    mortar = (np.mod(uv[:, 1], 0.4 * period) < 0.012) | (np.mod(u, period) < 0.012)
    return np.where(mortar[:, None], palette[-1], colors)


def _wall(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    colors = np.where((uv[:, 1] < 1.05)[:, None], palette[1], palette[0])
    return np.where((uv[:, 1] < 0.12)[:, None], palette[2], colors)


def _poster(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    """A picture of overlapping discs and bars on a ground, with a white rim."""
    rng = np.random.default_rng([seed, 11])
    colors = np.tile(palette[0], (len(uv), 1))
    for k in range(7):
        centre, radius = rng.random(2) * period, period * rng.uniform(0.08, 0.25)
        inside = ((uv - centre) ** 2).sum(1) < radius**2
        if k % 3 == 2:
            inside = np.abs(uv[:, k % 2] - centre[0]) < 0.3 * radius
        colors[inside] = palette[1 + k % (len(palette) - 1)]
    return colors


def _shelf(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    """Boards with books of many colours between them."""
    rng = np.random.default_rng([seed, 13])
    shelf = np.floor(uv[:, 1] / period).astype(int)
    book = np.floor(uv[:, 0] / 0.055 + 7.3 * shelf).astype(int)
    height = 0.55 + 0.35 * rng.random(997)[(book * 31 + shelf) % 997]
    colors = palette[1 + rng.integers(0, len(palette) - 1, 997)[(book * 17 + shelf * 5) % 997]]
    level = np.mod(uv[:, 1], period) / period
    colors = np.where((level > height)[:, None], 0.25 * palette[0], colors)
    return np.where((level < 0.09)[:, None], palette[0], colors)


_KINDS: dict[str, Callable[[Coordinates, Palette, float, int], Colors]] = {
    "plain": _plain,
    "planks": _planks,
    "checks": _checks,
    "stripes": _stripes,
    "bricks": _bricks,
    "wall": _wall,
    "poster": _poster,
    "shelf": _shelf,
}


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
        """The panel in pieces, and the surface coordinates of the vertices.

        Pieces measure 30 cm at most, so that none reaches behind a camera that sees it.
        """
        length_u, length_v = np.linalg.norm(self.u), np.linalg.norm(self.v)
        count_u, count_v = max(int(np.ceil(length_u / 0.3)), 1), max(int(np.ceil(length_v / 0.3)), 1)
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
    """The shadow of everything but floor, walls and ceiling."""
    props: Bool[np.ndarray, "face"] | None = None
    """Which faces belong to what stands among the people and can hide them; None where nothing does."""

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


def assembled(room: Sequence[Panel], props: Sequence[Panel] = ()) -> Scene:
    """The scene of a room and of what stands among the people."""
    panels = [*room, *props]
    parts = [panel.mesh() for panel in panels]
    number = np.concatenate([np.full(len(mesh.faces), k) for k, (mesh, _) in enumerate(parts)])
    casters = [mesh for panel, (mesh, _) in zip(panels, parts, strict=True) if panel.casts_shadow]
    return Scene(
        mesh=merged([mesh for mesh, _ in parts]),
        uv=np.concatenate([uv for _, uv in parts]),
        face_texture=number,
        textures=tuple(panel.texture for panel in panels),
        shadow=ShadowMap.of([merged(casters)] if casters else [], spacing=0.02, spread=0.05, bias=0.05),
        props=number >= len(room) if props else None,
    )


def merged(meshes: Sequence[Mesh]) -> Mesh:
    """Several meshes as one."""
    first = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, first[:-1], strict=True)]),
    )


def direction(angle: float) -> Float[np.ndarray, "3"]:
    """The horizontal direction of an angle (radians) from x."""
    return np.array([np.cos(angle), np.sin(angle), 0.0])


def box(place: Float[np.ndarray, "3"], size: Float[np.ndarray, "3"], turn: float, texture: Texture) -> list[Panel]:
    """A box without bottom whose footprint is centred at `place`."""
    u, v = size[0] * direction(turn), size[1] * direction(turn + np.pi / 2)
    z = np.array([0.0, 0.0, size[2]])
    a, b, c, d = place - (u + v) / 2, place + (u - v) / 2, place + (u + v) / 2, place + (v - u) / 2
    sides = [(a, u, z), (b, v, z), (c, -u, z), (d, -v, z), (a + z, u, v)]
    return [Panel(corner, first, second, texture) for corner, first, second in sides]
