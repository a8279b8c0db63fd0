"""Colour spaces and the colour similarity of two blobs (Eq. 7)."""

import math
from collections.abc import Callable, Sequence

import jax.numpy as jnp
from jaxtyping import Array, Float

Colors = Float[Array, "*batch 3"]
BroadcastColors = Float[Array, "*#batch 3"]
Planes = Sequence[Float[Array, "..."]]
"""The channels of colours, an array each."""

COLOR_RADIUS = {"hsv_shaded": 0.4, "hsv_cylinder": 0.4, "hsv_cone": 0.15, "hsv": 0.15, "rgb": 0.1, "lab": 0.2}
"""The colour spaces, each with the eps_sim of Eq. 7 that suits its scale."""

SPREAD = 0.07
"""Standard deviation of a channel (sRGB, 0 to 1) of what is seen of a subject, about the colours of its blobs."""
SHADING = 0.25
"""Standard deviation of its brightness, as a part of it: folds, and limbs that turn away from the light."""

_WHITE_D65 = (0.95047, 1.0, 1.08883)
_XYZ_FROM_RGB = (
    (0.4124564, 0.3575761, 0.1804375),
    (0.2126729, 0.7151522, 0.0721750),
    (0.0193339, 0.1191920, 0.9503041),
)
_LAB_KNEE = 6.0 / 29.0


def wendland(distance: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
    """The C2 radial basis function phi_{3,1}(r) = (1-r)^4 (4r+1) on [0, 1), 0 beyond."""
    inside = jnp.maximum(1.0 - distance, 0.0)
    return inside**4 * (4.0 * distance + 1.0)


def color_distance(a: BroadcastColors, b: BroadcastColors, space: str) -> Float[Array, "*#batch"]:
    """Euclidean distance of colours of one space; in `hsv` the hue, in turns, wraps around."""
    # Channel by channel: a sum over a last axis of three takes seven times as long on a CPU.
    difference = a - b
    return distance_of_planes([difference[..., k] for k in range(3)], space)


def squared_distance(differences: Planes, space: str) -> Float[Array, "*batch"]:
    """The square of `color_distance` from the differences of the channels, each an array."""
    first, *others = differences
    if space == "hsv":
        first = first - jnp.round(first)
    return sum((other**2 for other in others), first**2)


def distance_of_planes(differences: Planes, space: str) -> Float[Array, "*batch"]:
    """`color_distance` from the differences of the channels, each an array."""
    squared = squared_distance(differences, space)
    positive = squared > 0.0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, squared, 1.0)), 0.0)


def distance_from_box(color: Planes, low: Planes, high: Planes, space: str) -> Float[Array, "*batch"]:
    """The least that `color_distance` can be between a colour and any within a box, channel by channel."""
    beyond = lambda value, low, high: jnp.maximum(jnp.maximum(low - value, value - high), 0.0)
    outside = list(map(beyond, color, low, high))
    if space == "hsv":  # hues are on a circle
        outside[0] = jnp.zeros_like(outside[0])
    return distance_of_planes(outside, space)


def color_similarity(
    a: BroadcastColors, b: BroadcastColors, space: str, color_radius: Float[Array, ""]
) -> Float[Array, "*#batch"]:
    """d(c_i, c_j) of Eq. 7: 1 for equal colours, 0 from `color_radius` (eps_sim) on."""
    return wendland(color_distance(a, b, space) / color_radius)


def from_rgb(rgb: Colors, space: str) -> Colors:
    """Colours in `space` from sRGB in 0..1.

    hsv_cylinder: (s cos h, s sin h, v); hsv_shaded: the same with `_shade` of v; hsv_cone: (s v cos h, s v sin h, v);
    hsv: hue in turns; lab: Lab / 100.

    Raises:
        ValueError: no such space.
    """
    return _conversions(space)[0](rgb)


def to_rgb(colors: Colors, space: str) -> Colors:
    """SRGB in 0..1 from colours in `space`, clipped to what sRGB holds."""
    return jnp.clip(_conversions(space)[1](colors), 0.0, 1.0)


def averaging_space(space: str) -> str:
    """The space in which colours that end up in `space` are averaged: without wrap-around, and with v as it is.

    What shading hides from comparisons still splits a picture into blobs: edges stay where they were.
    """
    return "hsv_cylinder" if space in ("hsv", "hsv_shaded") else space


def convert(colors: Colors, source: str, target: str) -> Colors:
    """Colours of the space `source`, in the space `target`."""
    if (source, target) == ("hsv_cylinder", "hsv_shaded"):  # in every frame, so without the angle of the hue
        return _with_value(colors, _shade)
    return colors if source == target else from_rgb(to_rgb(colors, source), target)


def _conversions(space: str) -> tuple[Callable[[Colors], Colors], Callable[[Colors], Colors]]:
    table = {
        "rgb": (lambda rgb: rgb, lambda rgb: rgb),
        "hsv": (_hsv_from_rgb, _rgb_from_hsv),
        "hsv_cylinder": (
            _cylinder_from_rgb,
            lambda c: _rgb_from_hsv(_hsv_from_cylinder(c)),
        ),
        "hsv_shaded": (
            lambda rgb: _with_value(_cylinder_from_rgb(rgb), _shade),
            lambda c: _rgb_from_hsv(_hsv_from_cylinder(_with_value(c, _unshade))),
        ),
        "hsv_cone": (_cone_from_rgb, _rgb_from_cone),
        "lab": (_lab_from_rgb, _rgb_from_lab),
    }
    if space not in table:
        raise ValueError(f"no colour space {space!r}; choose one of {', '.join(sorted(table))}")
    return table[space]


def _cylinder_from_rgb(rgb: Colors) -> Colors:
    """(s cos h, s sin h, v): the hue is an offset of at most 60 degrees from red, green or blue.

    So sine and cosine are short series (exact to float32), five times faster than the library's on a CPU.
    """
    red, green, blue = rgb[..., 0], rgb[..., 1], rgb[..., 2]
    value = jnp.maximum(jnp.maximum(red, green), blue)
    chroma = value - jnp.minimum(jnp.minimum(red, green), blue)
    saturation = chroma / jnp.where(value > 0.0, value, 1.0)
    most_red, most_green = value == red, value == green
    difference = jnp.where(most_red, green - blue, jnp.where(most_green, blue - red, red - green))
    angle = (jnp.pi / 3.0) * difference / jnp.where(chroma > 0.0, chroma, 1.0)
    cosine, sine = saturation * _series(_COSINE, angle**2), saturation * angle * _series(_SINE, angle**2)
    # Turned by 0, 120 or 240 degrees.
    x = jnp.where(most_red, 1.0, -0.5)
    y = jnp.where(most_red, 0.0, jnp.where(most_green, _SIN_120, -_SIN_120))
    return jnp.stack([x * cosine - y * sine, y * cosine + x * sine, value], -1)


_SIN_120 = math.sqrt(0.75)
_COSINE = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(6))
_SINE = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(6))
"""Taylor coefficients of cos and sin x / x in x^2."""


def _series(coefficients: tuple[float, ...], x: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
    total = jnp.full_like(x, coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        total = total * x + coefficient
    return total


def _hsv_from_rgb(rgb: Colors) -> Colors:
    red, green, blue = rgb[..., 0], rgb[..., 1], rgb[..., 2]
    value = jnp.maximum(jnp.maximum(red, green), blue)
    chroma = value - jnp.minimum(jnp.minimum(red, green), blue)
    safe = jnp.where(chroma > 0.0, chroma, 1.0)
    sextant = jnp.where(
        value == red,
        (green - blue) / safe,
        jnp.where(value == green, 2.0 + (blue - red) / safe, 4.0 + (red - green) / safe),
    )
    turns = sextant / 6.0
    hue = jnp.where(chroma > 0.0, turns - jnp.floor(turns), 0.0)
    saturation = chroma / jnp.where(value > 0.0, value, 1.0)
    return jnp.stack([hue, saturation, value], -1)


def _rgb_from_hsv(hsv: Colors) -> Colors:
    hue, saturation, value = hsv[..., 0], hsv[..., 1], hsv[..., 2]
    channels = []
    for shift in (5.0, 3.0, 1.0):
        k = jnp.mod(shift + 6.0 * hue, 6.0)
        channels.append(value - value * saturation * jnp.clip(jnp.minimum(k, 4.0 - k), 0.0, 1.0))
    return jnp.stack(channels, -1)


def _hsv_from_cylinder(cylinder: Colors) -> Colors:
    hue = jnp.mod(jnp.arctan2(cylinder[..., 1], cylinder[..., 0]) / (2.0 * jnp.pi), 1.0)
    saturation = jnp.hypot(cylinder[..., 0], cylinder[..., 1])
    return jnp.stack([hue, jnp.minimum(saturation, 1.0), cylinder[..., 2]], -1)


_SHADES = SHADING / SPREAD


def _shade(value: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
    """Brightness in whose steps shading counts no more than other changes of a colour.

    The integral of `SPREAD / sqrt(SPREAD^2 + (SHADING v)^2)`: v where it is dark, as its logarithm where it is bright.
    """
    return jnp.arcsinh(_SHADES * value) / _SHADES


def _unshade(shade: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
    return jnp.sinh(_SHADES * shade) / _SHADES


def _with_value(cylinder: Colors, change: Callable[[Float[Array, "*batch"]], Float[Array, "*batch"]]) -> Colors:
    return jnp.concatenate([cylinder[..., :2], change(cylinder[..., 2:])], -1)


def _cone_from_rgb(rgb: Colors) -> Colors:
    cylinder = _cylinder_from_rgb(rgb)
    return jnp.concatenate([cylinder[..., :2] * cylinder[..., 2:], cylinder[..., 2:]], -1)


def _rgb_from_cone(cone: Colors) -> Colors:
    value = cone[..., 2:]
    chroma = cone[..., :2] / jnp.where(value > 0.0, value, 1.0)
    return _rgb_from_hsv(_hsv_from_cylinder(jnp.concatenate([chroma, value], -1)))


def linear_light(rgb: Colors) -> Colors:
    """How much light an sRGB colour (0..1) stands for, 0..1 (IEC 61966-2-1)."""
    return jnp.where(rgb <= 0.04045, rgb / 12.92, ((jnp.maximum(rgb, 0.04045) + 0.055) / 1.055) ** 2.4)


def from_linear_light(linear: Colors) -> Colors:
    """The sRGB colour that stands for so much light; the inverse of `linear_light`."""
    gamma = 1.055 * jnp.maximum(linear, 0.0031308) ** (1.0 / 2.4) - 0.055
    return jnp.where(linear <= 0.0031308, 12.92 * linear, gamma)


def _lab_from_rgb(rgb: Colors) -> Colors:
    matrix = jnp.array(_XYZ_FROM_RGB, rgb.dtype)
    xyz = jnp.einsum("ij,...j->...i", matrix, linear_light(rgb), precision="highest")
    ratio = xyz / jnp.array(_WHITE_D65, rgb.dtype).reshape((1,) * (rgb.ndim - 1) + (3,))
    knee = _LAB_KNEE
    f = jnp.where(ratio > knee**3, jnp.cbrt(jnp.maximum(ratio, knee**3)), ratio / (3.0 * knee**2) + 4.0 / 29.0)
    x, y, z = f[..., 0], f[..., 1], f[..., 2]
    return jnp.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], -1) / 100.0


def _rgb_from_lab(lab: Colors) -> Colors:
    y = (100.0 * lab[..., 0] + 16.0) / 116.0
    f = jnp.stack([y + lab[..., 1] / 5.0, y, y - lab[..., 2] / 2.0], -1)
    knee = _LAB_KNEE
    ratio = jnp.where(f > knee, f**3, 3.0 * knee**2 * (f - 4.0 / 29.0))
    xyz = ratio * jnp.array(_WHITE_D65, lab.dtype).reshape((1,) * (lab.ndim - 1) + (3,))
    inverse = jnp.linalg.inv(jnp.array(_XYZ_FROM_RGB, lab.dtype))
    return from_linear_light(jnp.clip(jnp.einsum("ij,...j->...i", inverse, xyz, precision="highest"), 0.0, 1.0))
