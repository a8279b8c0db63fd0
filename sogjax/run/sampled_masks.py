"""What is not the background in frames spread over a whole clip, in cells."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.actor.frame_choice import Mask
from sogjax.io.painted import painted_masks
from sogjax.io.recording import Recording
from sogjax.model.camera import Camera
from sogjax.model.cores import in_threads
from sogjax.run.clip import Clip, SampleKind, cell_grids, spread_frames
from sogjax.scene.background import BackgroundImage, cell_means, stack_background
from sogjax.scene.background_difference import closed, widened
from sogjax.scene.cells import CellGrid
from sogjax.scene.foreground import BackgroundModel, log_odds
from sogjax.scene.occluders import painted
from sogjax.scene.segmentation import largest_parts
from sogjax.scene.subject_colors import Scene, subject_colors
from sogjax.scene.visual_hull import resized

MOST_LOOKED_AT = 40
DEPTH = 9
"""Depth of the quad-tree whose cells are looked at."""
FOREGROUND = 0.5
"""Log odds above which a cell counts as foreground."""
LEARNT_FROM = 8
"""So many of the frames show the people's colours."""
SELDOM = 0.5
"""Part of the frames in which a camera shows something that is not the background, or it hardly ever shows anybody."""
SEAM = 5
"""Cells: a narrower gap in what is not the background lies between what was told from it in two ways."""

Picture = UInt8[np.ndarray, "_rows _columns 3"]


@dataclass(frozen=True)
class SampledMasks:
    """Frames of a clip; everything by camera (its index in the rig)."""

    frames: list[int]
    """The recording's numbers, ascending."""
    masks: list[dict[int, Mask]]
    """A mask of each of them: what is not the background."""
    pictures: list[dict[int, Picture]]
    """The cells' colours, BGR."""
    unknown: dict[int, Mask]
    """Where nothing is known of the background, or something stands in front."""
    calm: dict[int, Mask]
    """Where nothing moves there."""
    cameras: dict[int, Camera]
    """The cameras, for pictures of the masks' size."""
    grids: tuple[CellGrid, ...]

    @property
    def undecided(self) -> bool:
        """Whether anything is unknown."""
        return any(mask.any() for mask in self.unknown.values())

    def where_seen(self) -> "SampledMasks":
        """The same without the cameras that hardly ever show anybody: something stands before them."""
        shown = [k for k in self.cameras if np.mean([masks[k].any() for masks in self.masks]) > SELDOM]
        return replace(
            self,
            masks=[{k: masks[k] for k in shown} for masks in self.masks],
            pictures=[{k: pictures[k] for k in shown} for pictures in self.pictures],
            unknown={k: self.unknown[k] for k in shown},
            calm={k: self.calm[k] for k in shown},
            cameras={k: self.cameras[k] for k in shown},
        )

    def decided(self, up: Float[np.ndarray, "3"]) -> "SampledMasks":
        """The same, in which colours tell the people from the room where nothing is known.

        What they do not tell in most frames stays unknown. As it is, where no frame shows anybody.
        """
        scenes = [
            Scene(shown, masks, self.unknown, self.calm) for shown, masks in zip(self.pictures, self.masks, strict=True)
        ]
        colors = subject_colors(scenes[:: max(-(-len(scenes) // LEARNT_FROM), 1)], self.cameras, up)
        if colors is None:
            return self
        decided = in_threads(lambda scene: {k: colors.decided(k, scene) for k in scene.masks}, scenes)
        masks = [
            {k: _joined(mask | told[k].subject, self.unknown[k]) for k, mask in scene.masks.items()}
            for scene, told in zip(scenes, decided, strict=True)
        ]
        untold = {k: np.mean([of_frame[k].untold for of_frame in decided], axis=0) > 0.5 for k in self.unknown}
        return replace(self, masks=masks, unknown=untold)


def mask_samples(recording: Recording, frames: Sequence[int] | None = None) -> SampleKind:
    """The pictures, in cells (BGR), that are looked at for people: of the frames, or else spread over the clip."""
    grids = cell_grids(recording, DEPTH)
    name = "masks" if frames is None else f"masks_{hashlib.sha256(str([*frames]).encode()).hexdigest()[:12]}"
    numbers = tuple(spread_frames(recording.frames, MOST_LOOKED_AT) if frames is None else frames)
    return SampleKind(name, numbers, lambda camera, picture: grids[camera].averages(picture))


def masks_of_samples(
    clip: Clip, learnt: Sequence[BackgroundImage], frames: Sequence[int] | None = None
) -> SampledMasks:
    """The masks of the frames, or else of at most `MOST_LOOKED_AT` spread over the clip, that all cameras have."""
    recording, grids = clip.recording, cell_grids(clip.recording, DEPTH)
    empty = BackgroundModel.from_background(stack_background(learnt, grids))
    shown = jnp.asarray(painted(painted_masks(recording), grids) > 0.0)
    empty = eqx.tree_at(lambda model: model.known, empty, empty.known & shown)
    sampled = clip.sampled([mask_samples(recording, frames)])[0]
    frames = sorted(set.intersection(*(set(of_camera) for of_camera in sampled)))
    pictures = [{k: of_camera[frame] for k, of_camera in enumerate(sampled)} for frame in frames]
    known = np.asarray(empty.known)
    sides = [(grid.width / grid.cell_size, grid.height / grid.cell_size) for grid in grids]
    return SampledMasks(
        frames=frames,
        masks=[_masks(_odds(list(shown.values()), grids, empty), grids) for shown in pictures],
        pictures=pictures,
        unknown={k: ~known[k, : grid.rows, : grid.columns] for k, grid in enumerate(grids)},
        calm={k: cell_means(learnt[k].calm.astype(np.float32), grid) > 0.5 for k, grid in enumerate(grids)},
        cameras={k: resized(recording.rig.camera(name), sides[k]) for k, name in enumerate(recording.rig.names)},
        grids=grids,
    )


def _joined(mask: Mask, unknown: Mask) -> Mask:
    """A mask without its seams and small parts."""
    return largest_parts(mask | (closed(mask, SEAM) & widened(unknown, SEAM)))


def _odds(
    pictures: Sequence[Picture], grids: Sequence[CellGrid], empty: BackgroundModel
) -> Float[np.ndarray, "camera rows columns"]:
    shape = empty.known.shape
    cells = np.zeros((*shape, 3), np.float32)
    for k, (picture, grid) in enumerate(zip(pictures, grids, strict=True)):
        cells[k, : grid.rows, : grid.columns] = picture[..., ::-1] / 255.0
    return np.asarray(log_odds(jnp.asarray(cells), empty, None))


def _masks(odds: Float[np.ndarray, "camera rows columns"], grids: Sequence[CellGrid]) -> dict[int, Mask]:
    return {k: _mask(odds[k, : grid.rows, : grid.columns]) for k, grid in enumerate(grids)}


def _mask(odds: Float[np.ndarray, "rows columns"]) -> Mask:
    found = cv2.morphologyEx((odds > FOREGROUND).astype(np.uint8), cv2.MORPH_OPEN, np.ones((2, 2), np.uint8))
    return largest_parts(found > 0)
