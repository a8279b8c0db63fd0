"""What stands in the room, as textured panels, and all of it as one mesh."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.synth.figure import Mesh
from sogjax.synth.light import ShadowMap
from sogjax.synth.textures import Texture

_CELL = 0.3
"""Panels are cut into pieces of at most this size, so that none reaches behind a camera that sees it."""


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
