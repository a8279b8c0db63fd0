"""Pictures of the empty scene held against what the videos show: moved to its place, in its light, or found unfit.

Videos are filmed before or after the picture is taken: a stand was touched, a lamp switched on, somebody still in it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from sogjax.scene.background_difference import background_difference, channel_max, opened, same_exposure


def median_picture(frames: Sequence[UInt8[np.ndarray, "rows columns 3"]]) -> UInt8[np.ndarray, "rows columns 3"]:
    """The median of every number of some pictures, rounded down.

    Whole pictures are compared and exchanged (odd-even transposition), thirty times as fast as what numpy does.
    """
    ordered = list(frames)
    for turn in range(len(ordered)):
        for k in range(turn % 2, len(ordered) - 1, 2):
            ordered[k : k + 2] = np.minimum(*ordered[k : k + 2]), np.maximum(*ordered[k : k + 2])
    low, high = ordered[(len(ordered) - 1) // 2], ordered[len(ordered) // 2]
    return low + (high - low) // 2


BLOCKS = 5
"""The picture is cut into so many columns, and as many rows as that width allows; the subject covers some of them."""
CLEAR = 0.15
"""Response of the phase correlation from which on a block tells its shift."""
FEWEST_BLOCKS = 4
FARTHEST = 1.0
"""Pixels of the working picture that a camera on a stand may shift."""


def block_shifts(
    first: UInt8[np.ndarray, "rows columns 3"], second: UInt8[np.ndarray, "rows columns 3"]
) -> Float[np.ndarray, "block 2"]:
    """How far blocks of the second picture lie from those of the first (pixels to the right and down).

    Only those with a pattern that both show.
    """
    grey = [cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY).astype(np.float32) for picture in (first, second)]
    size = max(grey[0].shape[1] // BLOCKS // 2, 8) * 2  # OpenCV finds half a pixel too much for odd sizes
    window = cv2.createHanningWindow((size, size), cv2.CV_32F)
    found = []
    for row in range(0, grey[0].shape[0] - size + 1, size):
        for column in range(0, grey[0].shape[1] - size + 1, size):
            before, after = (np.ascontiguousarray(one[row : row + size, column : column + size]) for one in grey)
            shift, response = cv2.phaseCorrelate(before, after, window)
            if response > CLEAR:
                found.append(shift)
    return np.array(found).reshape(-1, 2)


ALIKE = 0.75
"""Pixels of the working picture within which blocks say the same shift."""
MOST_ALIKE = 0.6
"""Share of the blocks that must, for the picture to be moved as a whole."""
TONE = 0.15
"""Share of the light from which on a picture is matched in tone: less is evened out in every frame."""
DIFFERENT = 25.0
"""Grey levels, in some channel, that are no noise nor a place that is a little off."""
GROWN = 12.0
"""Grey levels from which on a place belongs to something different beside it."""
LEAST_ALIKE = 0.8
"""Share of the picture that must be that of the videos where too few blocks have a pattern to tell."""
LARGE = 3e-3
"""Share of a picture from which on a difference may be somebody."""
OF_OTHER_COLOR = 0.3
"""Share of a difference that no shadow explains, from which on it may be somebody: between the legs of a chair the
floor lies in the shadow of who sits on it, and its outline is clearer in the light."""
CLEARER = 1.2
"""How many times as clear the outline of what stands in one picture is, as the same line is in the other one."""


@dataclass(frozen=True)
class FittedPlate:
    """A picture of the empty scene, as the videos would show it."""

    picture: UInt8[np.ndarray, "_h _w 3"]
    """BGR; the very picture that was given, where it agrees with the videos."""
    known: Bool[np.ndarray, "_h _w"]
    """False where the picture says nothing: beside a border from which it was moved away, and where somebody stands."""
    shift: tuple[float, float]
    """How far it was moved, pixels of the picture, to the right and down; 0 where it agrees."""
    tone: float
    """How many times as bright it was made; 1 where it agrees."""
    other: float
    """Share of the picture that shows something which the videos do not."""
    alike: float
    """Share of the picture that is that of the videos."""
    fits: bool
    """Whether it shows the place of the videos."""

    @classmethod
    def unseen(cls, plate: UInt8[np.ndarray, "_h _w 3"]) -> "FittedPlate":
        """A picture of a camera whose video shows nothing to hold it against."""
        return cls(plate, np.ones(plate.shape[:2], bool), (0.0, 0.0), 1.0, 0.0, 1.0, True)

    @property
    def pixels(self) -> float:
        """By how many of its pixels it was moved."""
        return float(np.hypot(*self.shift))

    def said(self, name: str) -> str | None:
        """What is to be said of the picture of this name, with the remedy; None: nothing."""
        take = f"take {name} again, of the empty scene, with the camera and the light as in the videos"
        if not self.fits:
            return (
                f"{name} does not show what the videos of this camera show ({self.alike:.0%} of it agrees): the camera "
                f"was moved, or picture or video are another camera's (`sogjax check` tells); {take}"
            )
        done = []
        if self.pixels:
            done.append(f"is {self.pixels:.1f} pixels beside the videos, and was moved")
        if self.tone != 1.0:
            done.append(f"shows {1.0 / self.tone:.2f} times the light of the videos, and was matched")
        if self.other:
            done.append(
                f"shows somebody or something that the videos do not ({self.other:.1%} of it), and is not used there"
            )
        return f"{name} {'; it '.join(done)}; {take}" if done else None


def fitted_plate(
    plate: UInt8[np.ndarray, "_h _w 3"], scene: UInt8[np.ndarray, "rows columns 3"], same_light: bool = False
) -> FittedPlate:
    """A picture of the empty scene moved and matched to `scene`, the median of a camera's video at the working size.

    With `same_light` it is only moved: `scene` is one picture, with the subject in it.
    """
    size = (scene.shape[1], scene.shape[0])
    at_work = lambda picture: cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    scale, shift = plate.shape[1] / scene.shape[1], _shift(at_work(plate), scene)
    moved, known = _moved(plate, scale * shift) if shift.any() else (plate, np.ones(plate.shape[:2], bool))
    small, seen = at_work(moved), at_work(known.astype(np.float32)) > 0.99
    gain, offset = same_exposure(scene, small)
    toned = np.clip(gain * small + offset, 0.0, 255.0)
    off = np.where(seen, channel_max(np.abs(cv2.blur(toned - scene.astype(float), (3, 3)))), 0.0)
    unlike = off > DIFFERENT
    alike = 1.0 - float(unlike[seen].mean()) if seen.any() else 0.0
    if not (_same_place(small, scene) or alike >= LEAST_ALIKE):
        return replace(FittedPlate.unseen(plate), alike=alike, fits=False)
    right, down = (scale * shift).tolist()
    found = FittedPlate(moved, known, (right, down), 1.0, 0.0, alike, True)
    if same_light:
        return found
    light = lambda picture: float(np.median(picture.mean(axis=-1))) + 1.0
    tone = light(toned) / light(small)
    if abs(np.log(tone)) > TONE:
        bright = np.clip(gain * moved.astype(np.float32) + offset, 0.0, 255.0)
        found = replace(found, picture=bright.round().astype(np.uint8), tone=tone)
    other = _only_in(toned.astype(np.uint8), scene, off)
    there = cv2.resize(other.astype(np.uint8), plate.shape[1::-1], interpolation=cv2.INTER_NEAREST) > 0
    return replace(found, known=known & ~there, other=float(other.mean()))


def _same_place(small: UInt8[np.ndarray, "rows columns 3"], scene: UInt8[np.ndarray, "_rows _columns 3"]) -> bool:
    """Whether most blocks whose pattern is in both pictures are at one place in them."""
    apart = np.linalg.norm(block_shifts(small, scene), axis=1)
    alike = int((apart < FARTHEST).sum())
    return alike >= FEWEST_BLOCKS and alike >= MOST_ALIKE * len(apart)


def _shift(
    small: UInt8[np.ndarray, "rows columns 3"], scene: UInt8[np.ndarray, "_rows _columns 3"]
) -> Float[np.ndarray, "2"]:
    """How far a picture must be moved (pixels, to the right and down) to lie on another; 0: it does, or who knows."""
    total, here = np.zeros(2), small
    for _ in range(2):  # blocks share less the farther they are apart
        found = block_shifts(here, scene)
        if len(found) < FEWEST_BLOCKS:
            break
        middle = np.median(found, axis=0)
        if np.mean(np.linalg.norm(found - middle, axis=1) < ALIKE) < MOST_ALIKE:
            break
        total = total + middle
        here, _ = _moved(small, total)
    return total if np.linalg.norm(total) > FARTHEST else np.zeros(2)


def _moved(
    picture: UInt8[np.ndarray, "_h _w 3"], shift: Float[np.ndarray, "2"]
) -> tuple[UInt8[np.ndarray, "_h _w 3"], Bool[np.ndarray, "_h _w"]]:
    """A picture moved by so many pixels to the right and down, and where it shows something then."""
    move, size = np.array([[1.0, 0.0, shift[0]], [0.0, 1.0, shift[1]]]), picture.shape[1::-1]
    there = cv2.warpAffine(np.full(picture.shape[:2], 255, np.uint8), move, size)
    return cv2.warpAffine(picture, move, size, borderMode=cv2.BORDER_REPLICATE), there == 255


def _only_in(
    plate: UInt8[np.ndarray, "rows columns 3"],
    scene: UInt8[np.ndarray, "_rows _columns 3"],
    off: Float[np.ndarray, "rows columns"],
) -> Bool[np.ndarray, "rows columns"]:
    """Where something stands in the plate and not in the videos: its outline is clear there, and not in these.

    `off` are the grey levels by which they differ.
    """
    square = lambda width: np.ones((width, width), np.uint8)
    edges = [channel_max(cv2.morphologyEx(part, cv2.MORPH_GRADIENT, square(3))) for part in (plate, scene)]
    count, labels = cv2.connectedComponents(opened(off > GROWN, 3).astype(np.uint8))
    different = background_difference(scene, plate).different
    found = np.zeros(off.shape, bool)
    for number in range(1, count):
        part = labels == number
        if part.mean() < LARGE or off[part].max() < DIFFERENT or different[part].mean() < OF_OTHER_COLOR:
            continue
        wide = cv2.dilate(part.astype(np.uint8), square(5)) > 0
        outline = wide & ~(cv2.erode(part.astype(np.uint8), square(3)) > 0)
        own, others = (float(np.mean(edge[outline])) for edge in edges)
        if own > CLEARER * others:
            found |= cv2.dilate(part.astype(np.uint8), square(9)) > 0
    return found
