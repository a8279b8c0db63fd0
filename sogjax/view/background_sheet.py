"""A sheet of one camera's background: what it is, how far it varies, where it is unknown, and what stands before it."""

from collections.abc import Mapping

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from sogjax.view.contact_sheet import RED, Tile, contact_sheet

WIDEST = 20.0
"""Grey levels of spread that are shown white."""

Frame = tuple[UInt8[np.ndarray, "_h _w 3"], Float[np.ndarray, "_rows _columns"]]
"""A picture (BGR) and the probability of foreground."""


def background_sheet(
    title: str,
    picture: UInt8[np.ndarray, "_h _w 3"],
    spread: Float[np.ndarray, "_h _w"],
    known: Bool[np.ndarray, "_h _w"],
    frames: Mapping[int, Frame],
) -> UInt8[np.ndarray, "h w 3"]:
    """The sheet (BGR): background with what is unknown in red, spread, then each frame beside its foreground."""
    share = f"{float(1.0 - known.mean()):.1%} unknown"
    tiles = [
        Tile(picture, [(~known, RED)], f"background, {share}"),
        Tile(_grey(spread / WIDEST), [], f"spread, white: {WIDEST:g} grey levels or more"),
    ]
    for number, (image, probability) in frames.items():
        tiles.append(Tile(image, [], f"frame {number}"))
        tiles.append(Tile(_grey(probability), [], f"frame {number}: foreground, grey: unknown"))
    return contact_sheet(tiles, title)


def _grey(values: Float[np.ndarray, "_h _w"]) -> UInt8[np.ndarray, "_h _w 3"]:
    levels = np.rint(255.0 * np.clip(values, 0.0, 1.0)).astype(np.uint8)
    return cv2.cvtColor(levels, cv2.COLOR_GRAY2BGR)
