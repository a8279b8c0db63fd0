"""How much of people do masks show where the background is not known, and how much of the room?

    python experiments/masks.py [rows=['talk 2 6 videos 253']] [at=[5,20,35,50]] [out=outputs/masks]

Rows are those of `whole_runs.py` with videos alone. The masks of some frames, all people together, are held against
what differs from the rendered empty scene, where the background learnt from the clip is unknown: what part of the
people is missed there, and how much of the room is taken for them, as a part of what they cover. Prints a table.
"""

from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, Int, UInt8
from whole_runs import Settings as Runs
from whole_runs import linked_recording

from sogjax.actor.example_masks import example_masks
from sogjax.io.example_poses import ExamplePose
from sogjax.io.recording import open_recording
from sogjax.io.video import read_chosen, read_still
from sogjax.run.background import learn_background
from sogjax.run.recordings import opened
from sogjax.run.track import opened_clip
from sogjax.scene.background_difference import background_difference, reduced_mask
from sogjax.scene.segmentation import first_guess
from sogjax.settings.compose import track_config
from sogjax.study.script import machine_line, run_script, settings_from

ROWS = (
    *("talk 2 6 videos 253", "talk 2 6 videos 264", "talk 2 12 videos 35", "talk 2 12 videos 192"),
    *("talk 2 12 videos 187", "embrace 2 12 videos 233", "hug 2 12 videos 193", "couple 2 6 videos 262"),
    *("fight 2 6 videos 252", "pass 2 6 videos 116", "arms 1 6 videos 84", "arms 1 4 videos 215"),
    *("stoop 1 4 videos 92", "sit 1 12 videos 33", "sit 1 12 videos 209"),
)

Mask = Bool[np.ndarray, "_h _w"]


@dataclass
class Settings:
    """What is looked at, as `key=value` on the command line."""

    rows: list[str] = field(default_factory=lambda: [*ROWS])
    at: list[int] = field(default_factory=lambda: [5, 20, 35, 50])
    out: str = "outputs/masks"


def main() -> None:
    """Print the table."""
    settings = settings_from(Settings)
    print(f"{machine_line()}\n\n| recording | people before what is unknown | missed | room |\n|---|---|---|---|")
    for row in settings.rows:
        share, missed, room = _of_row(row, settings.at, Path(settings.out) / row.replace(" ", "_"))
        print(f"| {row} | {share:.0%} | {missed:.1%} | {room:.1%} |", flush=True)


def _of_row(row: str, frames: list[int], folder: Path) -> tuple[float, float, float]:
    """What part of the people is before what is unknown, what of it is missed, and what of the room is in masks."""
    path, rendered = linked_recording(row, Runs.frames, folder)
    recording, config, whole = opened(str(path)), track_config(recording=str(path)), open_recording(rendered)
    learnt = learn_background(opened_clip(recording, config), config.images.background).required()
    names, counts = recording.rig.names, np.zeros(4)
    empty = [read_still(whole, name, whole.background[name]) for name in names]
    for frame, pictures in read_chosen(recording, frames):
        images = {k: picture for k, picture in enumerate(pictures) if picture is not None}
        example = ExamplePose(f"frame_{frame}", None, {}, {}, None, frame).of_everybody(names)
        found = example_masks(recording, example, images, learnt)
        masks = found.masks | found.left_out
        for k, image in images.items():
            counts += _counts(image, empty[k], masks.get(k, np.zeros(image.shape[:2], bool)), learnt[k].known)
    people, before, missed, room = counts
    return before / people, missed / before, room / before


def _counts(
    image: UInt8[np.ndarray, "_h _w 3"], empty: UInt8[np.ndarray, "_h _w 3"], mask: Mask, known: Mask
) -> Int[np.ndarray, "4"]:
    """Pixels of people; of these before what is unknown; missed there; and of the room that is in the mask there."""
    people, shown = first_guess(background_difference(image, empty)), reduced_mask(mask)
    unknown = cv2.resize(known.astype(np.uint8), people.shape[::-1], interpolation=cv2.INTER_NEAREST) == 0
    counted = (people, people & unknown, people & ~shown & unknown, shown & ~people & unknown)
    return np.array([part.sum() for part in counted])


if __name__ == "__main__":
    run_script(main)
