"""Light of the rendered room: one lamp far away with soft shadows, light from all around, a faint second lamp."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Float, Int

from sogjax.synth.figure import Mesh
from sogjax.synth.raster import Window, rasterize
from sogjax.synth.rotations import frame, unit

LAMP = unit(np.array([0.34, -0.26, 0.90]))
"""Direction towards the lamp."""
UP = np.array([0.0, 0.0, 1.0])

_LAMP_COLOR = np.array([0.98, 0.94, 0.87], np.float32)
_FILL = unit(np.array([-0.6, 0.7, 0.35]))
_FILL_COLOR = np.array([0.10, 0.11, 0.13], np.float32)
_SKY = np.array([0.50, 0.51, 0.53], np.float32)
_GROUND = np.array([0.27, 0.26, 0.235], np.float32)
_FAR = 1e6


def ambient(normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Light from all around, more of it from above, and the faint second lamp."""
    share = (0.5 + 0.5 * normals[:, 2:]).astype(np.float32)
    fill = np.maximum(normals @ _FILL, 0.0).astype(np.float32)
    share, colors = share[:, 0], zip(_GROUND, _SKY - _GROUND, _FILL_COLOR, strict=True)
    return np.stack([ground + share * more + fill * filled for ground, more, filled in colors], -1)


def direct(normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Light of the lamp where nothing is in its way (Lambert)."""
    return np.maximum(normals @ LAMP, 0.0).astype(np.float32)[:, None] * _LAMP_COLOR


def linear_from_srgb(colors: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Share of light that a surface of this displayed colour sends back."""
    return np.asarray(colors, np.float32) ** np.float32(2.2)


def srgb_from_linear(light: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Displayed values in 0..1; what is too bright saturates."""
    return np.clip(light, 0.0, 1.0) ** np.float32(1.0 / 2.2)


def drifted(drift: float, share: float) -> Float[np.ndarray, "3"]:
    """What is left of the room's red, green and blue light after a share (0..1) of a clip.

    At the end there is less light by the share `drift`, and what there is is a little warmer.
    """
    change = 0.5 - 0.5 * np.cos(np.pi * share)
    return (1.0 - drift * change * np.array([0.9, 1.0, 1.15])).astype(np.float32)


@dataclass(frozen=True)
class ShadowMap:
    """Distances along the light at which meshes first stop it, on a grid across it."""

    axes: Float[np.ndarray, "3 3"]
    """Columns: the grid's x and y, and the direction from the lamp."""
    origin: Float[np.ndarray, "3"]
    """Where grid and distances begin, in the grid's axes (metres)."""
    spacing: float
    spread: float
    """Radius over which shadows are softened, metres."""
    bias: float
    depths: Float[np.ndarray, "row column"]

    @classmethod
    def of(
        cls,
        meshes: Sequence[Mesh],
        towards: Float[np.ndarray, "3"] = LAMP,
        spacing: float = 0.012,
        spread: float = 0.03,
        bias: float = 0.03,
    ) -> "ShadowMap":
        """The map of some meshes, lit from the direction `towards`; lengths in metres."""
        axes = frame(-towards, [1.0, 0.0, 0.0])
        if not meshes:
            return cls(axes, np.zeros(3), spacing, spread, bias, np.full((1, 1), _FAR, np.float32))
        points = [mesh.vertices @ axes for mesh in meshes]
        everything = np.concatenate(points)
        origin = everything.min(0) - np.array([spread, spread, 0.0]) - 2.0 * spacing
        extent = everything.max(0) - origin + spread + 2.0 * spacing
        size = np.ceil(extent[:2] / spacing).astype(int) + 1
        window = Window(0, 0, int(size[0]), int(size[1]))
        depths = np.full((window.height, window.width), _FAR, np.float32)
        for mesh, local in zip(meshes, points, strict=True):
            local = local - origin
            pixels, heights = local[:, :2] / spacing, local[:, 2] + 0.5
            hits = rasterize(pixels, heights, mesh.faces, window, perspective=False, cull=False)
            old = depths[hits.rows, hits.columns]
            depths[hits.rows, hits.columns] = np.minimum(old, hits.depths.astype(np.float32) - 0.5)
        return cls(axes, origin, spacing, spread, bias, depths)

    def lit(self, points: Float[np.ndarray, "n 3"], taps: int = 8) -> Float[np.ndarray, "n"]:
        """Share of the lamp that reaches each point (world), 0..1."""
        local = ((points @ self.axes) - self.origin).astype(np.float32)
        limit = local[:, 2] - np.float32(self.bias)
        places = local[:, :2].T * np.float32(1.0 / self.spacing)
        at = self._cells(*(places + np.float32(0.5)).astype(np.int32))
        least, greatest = (np.take(depths, at, mode="clip") for depths in self._around)
        share = (least >= limit).astype(np.float32)  # where all taps are in the light, or all in the dark
        edge = np.flatnonzero((least < limit) & (greatest >= limit))
        share[edge] = self._tapped(places[:, edge], limit[edge], taps)
        return share

    def _tapped(
        self, places: Float[np.ndarray, "2 n"], limit: Float[np.ndarray, "n"], taps: int
    ) -> Float[np.ndarray, "n"]:
        """Share of the taps around places (in cells) where nothing stops the light before a limit."""
        count = np.zeros(len(limit), np.float32)
        angles = 2.39996 * np.arange(taps)
        radii = self.spread * np.sqrt((np.arange(taps) + 0.5) / taps)
        for angle, radius in zip(angles, radii, strict=True):
            shift = (radius * np.array([np.cos(angle), np.sin(angle)]) / self.spacing + 0.5).astype(np.float32)
            at = self._cells(*(places + shift[:, None]).astype(np.int32))
            count += np.take(self._bordered, at, mode="clip") >= limit
        return count / np.float32(taps)

    def _cells(self, x: Int[np.ndarray, "n"], y: Int[np.ndarray, "n"]) -> Int[np.ndarray, "n"]:
        """Where columns and rows are in the bordered map; nothing is in the way outside."""
        height, width = self.depths.shape
        return (np.clip(y, -1, height) + 1) * (width + 2) + np.clip(x, -1, width) + 1

    @cached_property
    def _bordered(self) -> Float[np.ndarray, "row column"]:
        return np.pad(self.depths, 1, constant_values=_FAR)

    @cached_property
    def _around(self) -> tuple[Float[np.ndarray, "row column"], Float[np.ndarray, "row column"]]:
        """The least and the greatest depth that a tap can meet around each cell."""
        width = 2 * (int(self.spread / self.spacing) + 1) + 1
        kernel = np.ones((width, width), np.uint8)
        least = cv2.erode(self._bordered, kernel, borderType=cv2.BORDER_REPLICATE)
        return least, cv2.dilate(self._bordered, kernel, borderType=cv2.BORDER_REPLICATE)
