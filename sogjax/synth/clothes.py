"""Clothes, skin and hair: colours and patterns as functions of the surface in the bind pose."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from sogjax.synth.anatomy import INDEX, Anatomy
from sogjax.synth.flesh import AVERAGE_STATURE, PARTS, bind_pose

Colors = Float[np.ndarray, "n 3"]
Rgb = tuple[float, float, float]

_SKINS: tuple[Rgb, ...] = ((0.87, 0.68, 0.56), (0.78, 0.58, 0.45), (0.55, 0.38, 0.28), (0.93, 0.76, 0.66))
_HAIR: tuple[Rgb, ...] = ((0.16, 0.11, 0.08), (0.38, 0.25, 0.14), (0.08, 0.07, 0.07), (0.62, 0.47, 0.28))
_SHIRTS: tuple[tuple[Rgb, Rgb], ...] = (
    ((0.62, 0.20, 0.20), (0.82, 0.76, 0.68)),
    ((0.22, 0.36, 0.58), (0.80, 0.80, 0.78)),
    ((0.78, 0.62, 0.26), (0.36, 0.25, 0.20)),
    ((0.30, 0.48, 0.32), (0.72, 0.74, 0.58)),
    ((0.52, 0.34, 0.54), (0.78, 0.70, 0.78)),
)
_TROUSERS: tuple[Rgb, ...] = ((0.20, 0.25, 0.36), (0.42, 0.38, 0.30), (0.22, 0.22, 0.23), (0.36, 0.40, 0.36))
_SHOES: tuple[Rgb, ...] = ((0.80, 0.79, 0.77), (0.30, 0.20, 0.15), (0.15, 0.16, 0.19), (0.60, 0.25, 0.20))
_PATTERNS = ("stripes", "plaid", "checks", "bars", "dots")
_LONG = 1.9
_SLEEVES = (0.62, 0.75, _LONG)


@dataclass(frozen=True)
class Outfit:
    """What one person wears; colours are sRGB in 0..1."""

    skin: Rgb
    hair: Rgb
    shirt: tuple[Rgb, Rgb]
    trousers: Rgb
    shoes: Rgb
    pattern: str
    sleeve: float
    """How far the sleeves reach: 0 shoulder, 1 elbow, 2 wrist."""
    patterned_trousers: Rgb | None = None
    """The second colour of trousers with the shirt's pattern."""


def outfits_from_seed(rng: np.random.Generator, count: int, kind: str = "random") -> list[Outfit]:
    """Draw clothes for several people, who wear different ones unless `kind`, one of `settings.OUTFITS`, is alike."""
    drawn = _drawn(rng, count)
    if kind == "alike":
        return [replace(drawn[0], skin=outfit.skin, hair=outfit.hair) for outfit in drawn]
    return [_changed(outfit, kind, k) for k, outfit in enumerate(drawn)]


def _changed(outfit: Outfit, kind: str, number: int) -> Outfit:
    """Another kind of clothes for the person of this number; skin and hair stay."""
    if kind == "long_sleeves":
        return replace(outfit, sleeve=_LONG)
    if kind in ("patterned", "striped"):
        pattern = "stripes" if kind == "striped" else ("checks", "plaid", "dots", "bars")[number % 4]
        lighter = tuple(float(value) for value in 0.45 * np.array(outfit.trousers) + 0.42)
        return replace(outfit, pattern=pattern, sleeve=_LONG, patterned_trousers=lighter)
    if kind in ("plain", "black_suit"):
        color = (0.10, 0.10, 0.11) if kind == "black_suit" else outfit.shirt[0]
        return replace(outfit, shirt=(color, color), trousers=color, shoes=color, sleeve=_LONG)
    return outfit


def without_green(outfit: Outfit) -> Outfit:
    """The same clothes for a green room, where nobody wears green: what is green turns red."""
    red, green, blue = outfit.shirt[0]
    if green < max(red, blue):
        return outfit
    swapped = lambda color: (color[1], color[0], color[2])
    return replace(outfit, shirt=(swapped(outfit.shirt[0]), swapped(outfit.shirt[1])))


def _drawn(rng: np.random.Generator, count: int) -> list[Outfit]:
    draw = lambda items: [items[k % len(items)] for k in rng.permutation(len(items))]
    rows = zip(*(draw(items) for items in (_SKINS, _HAIR, _SHIRTS, _TROUSERS, _SHOES, _PATTERNS)), strict=False)
    sleeves = rng.choice(_SLEEVES, count)
    return [Outfit(*row, sleeve=float(sleeve)) for row, sleeve in zip(rows, sleeves, strict=False)]


@dataclass(frozen=True)
class Wardrobe:
    """An outfit fitted to a person: where each piece begins and ends on the surface of the bind pose."""

    outfit: Outfit
    anatomy: Anatomy
    frames: Float[np.ndarray, "22 4 4"]

    @classmethod
    def fitted(cls, outfit: Outfit, anatomy: Anatomy) -> "Wardrobe":
        """Fit the outfit to the person."""
        return cls(outfit, anatomy, anatomy.world_from_joint(bind_pose(anatomy)))

    def colors(self, part: Int[np.ndarray, "n"], rest: Float[np.ndarray, "n 3"]) -> Colors:
        """SRGB colours of surface points, given their part (index into PARTS) and bind position (metres)."""
        result = np.zeros((len(part), 3), np.float32)
        for k, name in enumerate(PARTS):
            chosen = np.flatnonzero(part == k)
            if len(chosen):
                side, _, kind = name.rpartition("_")
                result[chosen] = getattr(self, f"_{kind}")(np.take(rest, chosen, axis=0), side)
        return result

    def _local(self, joint: str, rest: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        frame = self.frames[INDEX[joint]].astype(rest.dtype)
        return (rest - frame[:3, 3]) @ frame[:3, :3]

    def _cloth(self, base: Rgb, other: Rgb | None, points: Float[np.ndarray, "n 3"], radius: float) -> Colors:
        """Cloth with the outfit's pattern in two colours, or plain."""
        if other is None:
            return np.tile(np.array(base), (len(points), 1))
        share = _pattern(self.outfit.pattern, points, radius)[:, None]
        return np.array(base) + share * (np.array(other) - np.array(base))

    def _trousers(self, points: Float[np.ndarray, "n 3"], radius: float) -> Colors:
        return self._cloth(self.outfit.trousers, self.outfit.patterned_trousers, points, radius)

    def _torso(self, rest: Float[np.ndarray, "n 3"], _: str) -> Colors:
        points = self._local("pelvis", rest)
        colors = self._cloth(*self.outfit.shirt, points, 0.134)
        belt = 0.055 * self.anatomy.stature / AVERAGE_STATURE
        below = points[:, 2] < belt
        colors[below] = self._trousers(points[below], 0.134)
        colors[np.abs(points[:, 2] - belt + 0.01) < 0.016] = 0.45 * np.array(self.outfit.trousers)
        neck = self._local("neck", rest)
        bare = (np.hypot(neck[:, 0] - 0.01, neck[:, 1]) < 0.08) & (self._over_collar(rest) > 0.0)
        colors[bare] = self.outfit.skin
        return colors

    def _over_collar(self, rest: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        """Height over the rim of the collar, which is lower in front."""
        neck = self._local("neck", rest) * (AVERAGE_STATURE / self.anatomy.stature)
        return neck[:, 2] + 0.45 * neck[:, 0] - 0.028

    def _head(self, rest: Float[np.ndarray, "n 3"], _: str) -> Colors:
        points = self._local("head", rest) * (AVERAGE_STATURE / self.anatomy.stature)
        x, y, z = points.T
        colors = np.tile(np.array(self.outfit.skin), (len(points), 1))
        collar = self._over_collar(rest) < 0.0
        colors[collar] = 0.85 * np.array(self.outfit.shirt[0])
        hair = (z > 0.105 + 0.35 * np.minimum(0.09 - x, 0.0)) | ((x < 0.0) & (z > 0.0 + 0.7 * (x + 0.03)))
        colors[hair & (x < 0.088) & ~collar] = self.outfit.hair
        front = x > 0.06
        colors[front & (((np.abs(y) - 0.032) / 0.014) ** 2 + ((z - 0.052) / 0.008) ** 2 < 1)] = 0.12
        colors[front & (((np.abs(y) - 0.033) / 0.02) ** 2 + ((z - 0.073) / 0.006) ** 2 < 1)] = self.outfit.hair
        colors[front & ((y / 0.024) ** 2 + ((z + 0.012) / 0.007) ** 2 < 1)] = (0.62, 0.32, 0.30)
        return colors

    def _arm(self, rest: Float[np.ndarray, "n 3"], side: str) -> Colors:
        points = self._local(f"{side}_shoulder", rest)
        upper, lower = (self.anatomy.length(f"{side}_{joint}") for joint in ("elbow", "wrist"))
        sleeve = self.outfit.sleeve
        hem = sleeve * upper if sleeve < 1.0 else upper + (sleeve - 1.0) * lower
        colors = self._cloth(*self.outfit.shirt, points, 0.0669)
        colors[-points[:, 2] > hem - 0.015] = np.array(self.outfit.shirt[0]) * 0.8
        colors[-points[:, 2] > hem + 0.01] = self.outfit.skin
        return colors

    def _leg(self, rest: Float[np.ndarray, "n 3"], side: str) -> Colors:
        points = self._local(f"{side}_hip", rest)
        foot = self._local(f"{side}_ankle", rest)
        colors = self._trousers(points, 0.0669)
        seam = (np.abs(points[:, 0]) < 0.006) & (foot[:, 2] > 0.0)
        colors[seam] *= 0.7
        colors[foot[:, 2] < 0.022] = self.outfit.shoes
        sole = -self.anatomy.ankle_height + 0.016
        colors[foot[:, 2] < sole] = 0.5 * np.array(self.outfit.shoes) + 0.15
        return colors


def _pattern(name: str, points: Float[np.ndarray, "n 3"], radius: float) -> Float[np.ndarray, "n"]:
    """Share of the second colour, 0..1, at points in the frame of the piece (metres, z along it).

    `radius` turns angles around the piece into metres of cloth.
    """
    x, y, z = points.T
    around = radius * np.arctan2(y, x)
    square = lambda value, period, share=0.5: (np.mod(value, period) < share * period).astype(float)
    if name == "stripes":
        return square(z, 0.075, 0.45)
    if name == "bars":
        return square(around, 0.0701, 0.4)
    if name == "plaid":
        return 0.5 * square(z, 0.09, 0.45) + 0.5 * square(around, 0.0842, 0.45)
    if name == "checks":
        return np.abs(square(z, 0.11) - square(around, 0.1052))
    u, v = np.mod(around, 0.0701) - 0.035, np.mod(z, 0.07) - 0.035
    return (u * u + v * v < 0.021**2).astype(float)
