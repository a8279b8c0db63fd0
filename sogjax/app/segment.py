"""`sogjax segment`: the masks of the example poses, as pictures and on contact sheets."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from sogjax.actor.example_masks import ExampleMasks, example_masks
from sogjax.actor.make import examples_of
from sogjax.actor.silhouettes import load_images
from sogjax.app.config.schemas import SegmentConfig
from sogjax.data.image_file import write_mask
from sogjax.data.recording import ExamplePose, Recording
from sogjax.engine.outputs import free_path, results_folder
from sogjax.engine.recordings import opened
from sogjax.engine.terminal import progress, say
from sogjax.errors import InputError
from sogjax.sentences import counted
from sogjax.view.contact_sheet import GREEN, RED, Tile, contact_sheet
from sogjax.view.plots import write_png


def run(config: SegmentConfig) -> list[Path]:
    """Write the masks of every example pose, POSE/CAMERA.mask.png, and one contact sheet per pose.

    Raises:
        InputError: anything wrong with the recording or its example poses, a folder in which masks were given, or
            masks that are there.
    """
    recording = opened(config.recording, config.cameras)
    examples = examples_of(recording, config.subject)
    out = Path(config.out)
    _check_apart(recording, out)
    sheets: list[Path] = []
    for example in examples:
        free_path("out", out / example.name, config.overwrite)
        free_path("out", out / f"{example.name}.png", config.overwrite)
    with results_folder(out):
        for example in progress(examples, len(examples), "example poses"):
            images = load_images(recording, example)
            found = example_masks(recording, example, images)
            for warning in found.warnings:
                say(f"warning: {warning}")
            for older in (out / example.name).glob("*.mask.png"):
                older.unlink()
            for camera, mask in found.masks.items():
                write_mask(out / example.name / f"{recording.rig.names[camera]}.mask.png", mask)
            sheets.append(out / f"{example.name}.png")
            write_png(sheets[-1], mask_sheet(recording, example, images, found))
    for path in sheets:
        print(path)
    return sheets


def mask_sheet(
    recording: Recording,
    example: ExamplePose,
    images: Mapping[int, UInt8[np.ndarray, "_h _w 3"]],
    found: ExampleMasks,
) -> UInt8[np.ndarray, "h w 3"]:
    """The pictures with their masks: green if used, red if left out."""
    tiles = []
    for camera, image in images.items():
        name, origin = recording.rig.names[camera], found.origins.get(camera)
        if camera in found.masks:
            tiles.append(Tile(image, [(found.masks[camera], GREEN)], f"{name}: {origin}"))
        elif camera in found.left_out:
            tiles.append(Tile(image, [(found.left_out[camera], RED)], f"{name}: {origin}, left out"))
        else:
            tiles.append(Tile(image, [], f"{name}: no mask"))
    return contact_sheet(tiles, f"{recording.name}, {example.name}: {counted(len(found.masks), 'mask')}")


def _check_apart(recording: Recording, out: Path) -> None:
    """Masks that were given must not be overwritten."""
    given = (recording.path / "example_poses").resolve()
    if out.resolve() == given or given in out.resolve().parents or out.resolve() == recording.path.resolve():
        raise InputError(
            f"out={out}: lies in the recording, whose own masks would be overwritten; choose another folder, check "
            "the sheets, and copy the good masks"
        )
