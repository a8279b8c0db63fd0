"""Small plots of an evaluation, drawn with OpenCV."""

from collections.abc import Collection, Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.io.files import atomic_path

SIZE = (900, 360)
_LEFT, _RIGHT, _TOP, _BOTTOM = 64, 16, 34, 40
_INK, _GRID = (60, 60, 60), (225, 225, 225)
_COLORS = ((200, 110, 30), (40, 90, 230), (70, 160, 60), (170, 70, 160))
"""BGR of one curve after the other."""
_FAILED = (30, 30, 200)


def plot_per_point(
    errors: Float[np.ndarray, "point"], names: Sequence[str], title: str, *, failed: Collection[int] = ()
) -> UInt8[np.ndarray, "h w 3"]:
    """One bar per marker, joint or run, from metres, drawn in millimetres (BGR); no bar where the value is NaN.

    Args:
        errors: metres.
        names: written below the bars.
        title: above them, without the unit.
        failed: numbers of those for which the word "failed" stands instead of a bar.
    """
    values = 1000.0 * np.asarray(errors, float)
    top = _round_up(float(np.nanmax(values)) if np.isfinite(values).any() else 1.0)
    canvas = _axes(title, top)
    step = _plot_width() / max(len(values), 1)
    for k, (value, name) in enumerate(zip(values, names, strict=True)):
        left, right = _LEFT + step * (k + 0.15), _LEFT + step * (k + 0.85)
        if k in failed:
            _upward_text(canvas, "failed", (int(_LEFT + step * (k + 0.5)), SIZE[1] - _BOTTOM - 4), _FAILED)
        elif np.isfinite(value):
            corner = _pixel(np.array([left, _height(value, top)]))
            cv2.rectangle(canvas, corner, (int(right), SIZE[1] - _BOTTOM), _COLORS[0], -1)
        row = SIZE[1] - _BOTTOM + 14 + 11 * (k % 2)
        _text(canvas, name[: max(4, int(2 * step / 6))], (int(left), row), scale=0.3)
    return canvas


def write_png(path: Path, picture: UInt8[np.ndarray, "h w 3"]) -> None:
    """Write a picture (BGR) as PNG, in one piece or not at all."""
    with atomic_path(Path(path)) as temporary:
        temporary.write_bytes(cv2.imencode(".png", picture)[1].tobytes())


def _axes(title: str, top: float) -> UInt8[np.ndarray, "h w 3"]:
    canvas = np.full((SIZE[1], SIZE[0], 3), 255, np.uint8)
    for value in np.linspace(0.0, top, 5):
        y = int(_height(value, top))
        cv2.line(canvas, (_LEFT, y), (SIZE[0] - _RIGHT, y), _GRID, 1)
        _text(canvas, f"{value:g}", (12, y + 4))
    _text(canvas, f"{title} (mm)", (_LEFT, 20), scale=0.5)
    return canvas


def _plot_width() -> int:
    return SIZE[0] - _LEFT - _RIGHT


def _height(value: float | np.ndarray, top: float) -> np.ndarray:
    return np.asarray(SIZE[1] - _BOTTOM - (SIZE[1] - _BOTTOM - _TOP) * np.asarray(value) / top)


def _round_up(value: float) -> float:
    """The next of 1, 2, 4 or 10 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(max(value, 1e-3)))
    return float(next(step * power for step in (1.0, 2.0, 4.0, 10.0) if step * power >= value))


def _pixel(point: np.ndarray) -> tuple[int, int]:
    return round(float(point[0])), round(float(point[1]))


def _text(
    canvas: np.ndarray,
    text: str,
    corner: tuple[int, int],
    color: tuple[int, int, int] = _INK,
    scale: float = 0.38,
) -> None:
    cv2.putText(canvas, text, corner, cv2.FONT_HERSHEY_SIMPLEX, scale, color, 1, cv2.LINE_AA)


def _upward_text(canvas: np.ndarray, text: str, foot: tuple[int, int], color: tuple[int, int, int]) -> None:
    """Text that runs upward from the middle of its foot, so that it needs little width."""
    (length, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.38, 1)
    patch = np.full((height + 4, length + 2, 3), 255, np.uint8)
    _text(patch, text, (0, height + 1), color)
    upright = cv2.rotate(patch, cv2.ROTATE_90_COUNTERCLOCKWISE)
    rows, columns = upright.shape[:2]
    left = foot[0] - columns // 2
    canvas[foot[1] - rows : foot[1], left : left + columns] = upright
