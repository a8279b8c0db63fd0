"""`sogjax segment`: masks of the example poses, and the background of every camera, as pictures and on sheets."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from sogjax.actor.example_masks import ExampleMasks, example_masks
from sogjax.actor.make import examples_of
from sogjax.actor.silhouettes import load_images
from sogjax.cli.schemas import SegmentConfig
from sogjax.errors import InputError, counted
from sogjax.io.example_poses import ExamplePose
from sogjax.io.image_file import write_image, write_mask
from sogjax.io.painted import painted_masks
from sogjax.io.recording import Recording
from sogjax.io.recording_files import EXAMPLE_POSES
from sogjax.io.video import read_chosen
from sogjax.run.background import learn_background
from sogjax.run.clip import Clip
from sogjax.run.example_frames import with_examples
from sogjax.run.recordings import opened
from sogjax.run.run_folder import free_path, results_folder
from sogjax.run.terminal import alive, progress, say
from sogjax.scene.background import BackgroundImage
from sogjax.scene.foreground import foreground_probability
from sogjax.scene.occluders import painted
from sogjax.settings.method import ImagesConfig
from sogjax.view.sheets import background_sheet, write_occluders
from sogjax.view.tiles import GREEN, RED, Tile, contact_sheet

BACKGROUND = "background"
"""Folder of the background's sheets."""
OCCLUDERS = "occluders.png"
"""The sheet of what stands in front."""


def run(config: SegmentConfig) -> list[Path]:
    """Write the masks of every example pose with a sheet per pose, and a sheet of every camera's background.

    Raises:
        InputError: anything wrong with the recording or its example poses, a folder in which masks were given, or
            masks that are there.
    """
    recording = opened(config.recording, config.cameras)
    examples = examples_of(recording, config.subject) if recording.example_poses or config.subject else []
    frames = _frames(recording, config.frames, bool(examples))
    out = Path(config.out)
    _check_apart(recording, out)
    for example in examples:
        free_path("out", out / example.name, config.overwrite)
        free_path("out", out / f"{example.name}.png", config.overwrite)
    if frames:
        free_path("out", out / BACKGROUND, config.overwrite)
    if recording.occluders:
        free_path("out", out / OCCLUDERS, config.overwrite)
    with results_folder(out), alive("segmenting"):
        clip = Clip(recording, recording.frames, ImagesConfig().depth)
        learnt = with_examples(clip, lambda: learn_background(clip, "auto"))[1] if examples else None
        shown = progress(examples, len(examples), "example poses")
        sheets = [_masks(recording, example, out, learnt) for example in shown]
        if recording.occluders:
            sheets.append(_occluders(clip, out / OCCLUDERS))
        if frames:
            sheets += _background_sheets(clip, config.background, frames, out / BACKGROUND)
    for path in sheets:
        print(path)
    return sheets


def _occluders(clip: Clip, path: Path) -> Path:
    """Write the sheet of what was painted to stand in front, in the cells that it is counted in."""
    hidden = painted(painted_masks(clip.recording), clip.grids)
    middle = clip.numbers[len(clip.numbers) // 2]
    return write_occluders(path, clip.recording, clip.grids, hidden, middle, "what was painted to stand in front")


def _masks(recording: Recording, example: ExamplePose, out: Path, learnt: Sequence[BackgroundImage] | None) -> Path:
    """Write the masks of one example pose and their sheet."""
    images = load_images(recording, example)
    found = example_masks(recording, example, images, learnt)
    for warning in found.warnings:
        say(f"warning: {warning}")
    for older in (out / example.name).glob("*.mask.png"):
        older.unlink()
    for camera, mask in found.masks.items():
        write_mask(out / example.name / f"{recording.rig.names[camera]}.mask.png", mask)
    write_image(out / f"{example.name}.png", mask_sheet(recording, example, images, found))
    return out / f"{example.name}.png"


def _frames(recording: Recording, wanted: list[int] | None, has_examples: bool) -> list[int]:
    """The numbers of the frames to show; `wanted` count from the recording's first."""
    last = recording.num_frames - 1
    if wanted is None:
        return [] if has_examples else sorted({recording.frames[k] for k in (0, last // 2, last)})
    for frame in wanted:
        if not 0 <= frame <= last:
            raise InputError(f"frames: {frame} is no frame of {recording.path}; choose from 0 to {last}")
    return [recording.frames[k] for k in wanted]


def _background_sheets(clip: Clip, choice: str, frames: list[int], folder: Path) -> list[Path]:
    """Write a sheet of each camera's background, and what stands before it in some frames."""
    recording, learnt = clip.recording, learn_background(clip, choice)
    if learnt.cameras is None:
        raise InputError(f"{recording.path}: there is no background to show, since {learnt.reason}")
    folder.mkdir(parents=True, exist_ok=True)
    shown = dict(read_chosen(recording, frames))
    paths = []
    names = recording.rig.names
    for camera, name in enumerate(progress(names, len(names), "backgrounds")):
        background = learnt.cameras[camera]
        pictures = {
            frame: (images[camera], foreground_probability(images[camera], background))
            for frame, images in shown.items()
            if images[camera] is not None
        }
        title = f"{recording.name}, {name}: background from the {background.origin}"
        sheet = background_sheet(title, background.picture, background.spread, background.known, pictures)
        paths.append(folder / f"{name}.png")
        write_image(paths[-1], sheet)
    return paths


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
    given = EXAMPLE_POSES.of(recording.path).resolve()
    if out.resolve() == given or given in out.resolve().parents or out.resolve() == recording.path.resolve():
        raise InputError(
            f"out={out}: lies in the recording, whose own masks would be overwritten; choose another folder, check "
            "the sheets, and copy the good masks"
        )
