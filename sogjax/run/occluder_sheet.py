"""What stands in front, painted over the pictures of a frame: one tile a camera."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from sogjax.io.image_file import write_image
from sogjax.io.recording import Recording
from sogjax.io.video import read_frames
from sogjax.scene.cells import CellGrid
from sogjax.scene.occluders import HiddenFrom
from sogjax.view.tiles import BLUE, Tile, contact_sheet


def write_occluders(
    path: Path, recording: Recording, grids: Sequence[CellGrid], hidden: HiddenFrom, frame: int, title: str
) -> Path:
    """Write the pictures of a frame with the cells that hide something; returns the path.

    Raises:
        InputError: a picture cannot be read, or the file cannot be written.
    """
    images = next(iter(read_frames(recording, frame, frame + 1)))
    tiles = []
    for name, image, grid, of_camera in zip(recording.rig.names, images, grids, hidden, strict=True):
        inside = of_camera[: grid.rows, : grid.columns]
        shown = np.zeros((grid.height, grid.width, 3), np.uint8) if image is None else np.asarray(image)
        tiles.append(Tile(shown, [(_pixels(np.isfinite(inside), grid), BLUE)], f"{name}: {_told(inside)}"))
    write_image(path, contact_sheet(tiles, f"{recording.name}, frame {frame}: {title}"))
    return path


def _pixels(cells: Bool[np.ndarray, "rows columns"], grid: CellGrid) -> Bool[np.ndarray, "height width"]:
    side = grid.cell_size
    return np.repeat(np.repeat(cells, side, axis=0), side, axis=1)[: grid.height, : grid.width]


def _told(hidden: Float[np.ndarray, "rows columns"]) -> str:
    known = hidden[np.isfinite(hidden)]
    if not known.size:
        return "nothing"
    share = known.size / hidden.size
    what = "all" if not known.any() else f"what is behind {np.median(known[known > 0.0]):.1f} m (median)"
    return f"{share:.1%} of the cells hide {what}"
