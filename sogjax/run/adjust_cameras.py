"""Adjusted cameras: what can be asked of a recording, what was found, and files with which it can be used again."""

from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError, counted
from sogjax.io.calibration.load import save_calibration
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.files import write_file
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.io.recording_files import SETTINGS
from sogjax.io.recording_settings import offsets_line, with_entries
from sogjax.refine.adjustment import Adjustment
from sogjax.refine.camera_moves import PLACE, TIME, TURN, moved_cameras, velocities_of
from sogjax.run.run_files import CALIBRATION, DESCRIPTION

FEWEST_CAMERAS = {"cameras": 4, "offsets": 3}
"""One in doubt, and others that agree."""
FEWEST_FRAMES = 20
"""Fewer poses leave too much open."""
IN_A_LINE = 0.05
"""How far cameras must stand off the line that is nearest to them, in units of how far they stand apart along it."""
STILL = 0.002
"""Metres a frame: blobs that move less, on average, say nothing of parts of a frame."""


def parts_in_question(cameras: bool, offsets: bool) -> tuple[str, ...]:
    """The parts of the cameras' moves that are in question."""
    return (("turn", "place") if cameras else ()) + (("time",) if offsets else ())


def check_cameras(recording: Recording, motion: Motion, cameras: bool, offsets: bool) -> None:
    """Check that a clip can tell of cameras what is asked for.

    Raises:
        InputError: too few cameras, all in a line, too few frames, or nobody moves.
    """
    count = len(recording.rig)
    for name, asked in (("cameras", cameras), ("offsets", offsets)):
        if asked and count < (fewest := FEWEST_CAMERAS[name]):
            raise InputError(
                f"{name}=true: {recording.path} has {counted(count, 'camera')}; to tell which is wrong takes at "
                f"least {fewest}, so leave {name}=true out"
            )
        if asked and motion.num_frames < FEWEST_FRAMES:
            raise InputError(
                f"{name}=true: the motion has {counted(motion.num_frames, 'frame')}, too few to tell anything of "
                f"cameras; track at least {FEWEST_FRAMES}"
            )
    if cameras and _in_a_line(recording.rig):
        raise InputError(
            f"cameras=true: the cameras of {recording.path} stand in a line, so that it cannot be told which of "
            "them is wrong; leave cameras=true out, or calibrate again"
        )
    if offsets:
        speed = float(np.linalg.norm(velocities_of(motion.blob_means, motion.frame), axis=-1).mean())
        if speed < STILL:
            raise InputError(
                f"offsets=true: hardly anybody moves in this motion ({1e3 * speed:.1f} mm a frame), which says "
                "nothing of times; give a clip in which somebody does, or leave offsets=true out"
            )


def moves_of(recording: Recording) -> Float[np.ndarray, "camera 7"]:
    """The moves of cameras whose frames show, as the recording knows, what was a part of a frame earlier."""
    moves = np.zeros((len(recording.rig), TIME.stop))
    moves[:, TIME.start] = [-recording.frame_part.get(name, 0.0) for name in recording.rig.names]
    return moves


def moved_rig(rig: CameraRig, moves: Float[np.ndarray, "camera 7"]) -> CameraRig:
    """The rig with its cameras where they were found."""
    poses = moved_cameras(jax.tree.map(jnp.asarray, rig.cameras), jnp.asarray(moves, jnp.float32)).camera_from_world
    still = np.all(moves[:, : TIME.start] == 0.0, axis=1)[:, None, None]
    poses = jnp.where(still, rig.cameras.camera_from_world, poses)
    return CameraRig(rig.names, eqx.tree_at(lambda cameras: cameras.camera_from_world, rig.cameras, poses))


def camera_numbers(recording: Recording, found: Adjustment) -> dict[str, dict[str, Any]]:
    """What was found of each camera, for JSON: by name how far it was turned, moved, and is late.

    A camera without an entry stays as it is.
    """
    numbers: dict[str, dict[str, Any]] = {}
    for part, share in found.told.items():
        name, move = recording.rig.names[part.camera], found.moves[part.camera]
        entry = numbers.setdefault(name, {"turned_deg": 0.0, "moved_cm": 0.0, "late_frames": 0.0, "explained": {}})
        entry["explained"][part.name] = share
        entry["turned_deg"] = float(np.rad2deg(np.linalg.norm(move[TURN])))
        entry["moved_cm"] = 100.0 * float(np.linalg.norm(move[PLACE]))
        entry["late_frames"] = float(moves_of(recording)[part.camera, TIME.start] - move[TIME.start])
    return numbers


def camera_lines(numbers: dict[str, dict[str, Any]], names: tuple[str, ...]) -> str:
    """What is said of the cameras, in lines."""
    lines = []
    for name in names:
        if name not in numbers:
            continue
        entry = numbers[name]
        said = {
            "turn": f"turned by {entry['turned_deg']:.2f} degrees",
            "place": f"moved by {entry['moved_cm']:.1f} cm",
            "time": f"{abs(entry['late_frames']):.2f} frames {'late' if entry['late_frames'] > 0.0 else 'early'}",
        }
        parts = [
            f"{said[part]} ({entry['explained'][part]:.0%} explained)" for part in said if part in entry["explained"]
        ]
        lines.append(f"{name}: {', '.join(parts)}")
    rest = len(names) - len(lines)
    if not lines:
        return "no camera is clearly off: all stay as they are"
    lines += [f"the other {counted(rest, 'camera')} {'stays as it is' if rest == 1 else 'stay as they are'}"] * (
        rest > 0
    )
    return "\n".join(lines)


def write_cameras(
    recording: Recording, whole: Recording, moves: Float[np.ndarray, "camera 7"], out: Path
) -> list[Path]:
    """Write a calibration, and a recording.yaml that names it and the offsets, to be copied into the recording.

    Args:
        recording: as it was tracked, perhaps with some of its cameras.
        whole: the same with all.
        moves: of the former's cameras, those that the recording knew among them.
        out: a folder.

    Raises:
        InputError: a recording.yaml whose entries cannot be replaced line by line, or an unknown image size.
    """
    all_moves = np.zeros((len(whole.rig), moves.shape[1]))
    all_moves[[whole.rig.names.index(name) for name in recording.rig.names]] = moves
    save_calibration(CALIBRATION.of(out), moved_rig(whole.rig, all_moves))
    own = SETTINGS.of(whole.path)
    text = own.read_text(encoding="utf-8-sig") if own.is_file() else ""
    lines = {"calibration": f"calibration: {CALIBRATION.name}", "unit": "unit: m"}
    parts = {name: move[TIME.start] for name, move in zip(recording.rig.names, moves, strict=True)}
    offsets = {
        name: whole.frame_offset[name] - parts.get(name, -whole.frame_part.get(name, 0.0)) for name in whole.rig.names
    }
    if any(offsets.values()):
        lines["frame_offset"] = offsets_line({name: offset for name, offset in offsets.items() if offset})
    write_file(DESCRIPTION.of(out), with_entries(own, text, lines))
    return [CALIBRATION.of(out), DESCRIPTION.of(out)]


def _in_a_line(rig: CameraRig) -> bool:
    poses = np.asarray(rig.cameras.camera_from_world, float)
    centres = -np.einsum("cji,cj->ci", poses[:, :3, :3], poses[:, :3, 3])
    extents = np.linalg.svd(centres - centres.mean(axis=0), compute_uv=False)
    return bool(extents[1] <= IN_A_LINE * extents[0])
