"""`sogjax check`: what is wrong with a recording, and what to do about it."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from sogjax.check.calibration import unit_rig
from sogjax.check.examination import Examination, examined, opening_problems
from sogjax.check.findings import SEVERITIES, Finding
from sogjax.check.page import check_page
from sogjax.cli.schemas import CheckConfig
from sogjax.errors import InputError, counted
from sogjax.io.files import write_file
from sogjax.io.recording import Recording, open_recording
from sogjax.io.recording_files import SETTINGS
from sogjax.io.recording_settings import offsets_line, write_frame_offsets
from sogjax.run.recordings import body_named, extent_of, with_cameras
from sogjax.run.run_folder import results_folder
from sogjax.run.terminal import alive, progress, say
from sogjax.view.room import room_sheet

PAGE = "index.html"


def run(config: CheckConfig) -> list[Finding]:
    """Examine a recording, print the findings, and write check.json and the page.

    Raises:
        InputError: a recording that does not open, or that nothing right can be made of, once all that is wrong was
            said; an option that is out of range.
    """
    recording = _opened(config)
    start, frames = _stretch(config, recording)
    subject = None if config.body is None else extent_of(body_named(config.body))
    out = Path(config.out) if config.out else Path("outputs") / recording.name / "check"
    with results_folder(out), alive("examining the recording"):
        found = examined(recording, start, frames, config.largest_offset, progress, subject)
        write_file(out / "check.json", json.dumps(found.numbers, indent=1))
        write_file(out / PAGE, _page(recording, found, start, frames))
        (out / "check.png").unlink(missing_ok=True)  # of an older check
    for finding in found.findings:
        print(finding.line())
    _offer_offsets(config, recording, found)
    counts = [(sum(f.severity == kind for f in found.findings), kind) for kind in reversed(SEVERITIES)]
    shown = [counted(count, kind, "ok" if kind == "ok" else None) for count, kind in counts if count]
    say(", ".join(shown) + f"; see {out / PAGE}")
    if any(finding.severity == "error" for finding in found.findings):
        raise InputError(f"{recording.path}: nothing right can be made of it before what is called an error is mended")
    return found.findings


def _opened(config: CheckConfig) -> Recording:
    """The recording; all problems of its files are printed before the first one is raised."""
    path = Path(config.recording)
    try:
        recording = open_recording(path)
    except InputError as error:
        if path.is_dir():
            problems = opening_problems(path, error)
            if len(problems) > 1 or problems[0].cause:
                _say_all(path, problems)
        raise
    return with_cameras(recording, config.cameras or None)


def _say_all(path: Path, problems: Sequence[Finding]) -> NoReturn:
    for finding in problems:
        print(finding.line())
    raise InputError(f"{path}: cannot be opened; mend what is said above of its files")


def _stretch(config: CheckConfig, recording: Recording) -> tuple[int, int]:
    """The number of the first frame to examine, and how many are examined."""
    if config.frames < 1:
        raise InputError(f"frames={config.frames}: must be 1 or more")
    if config.largest_offset < 0:
        raise InputError(f"largest_offset={config.largest_offset}: must be 0 or more")
    frames = min(config.frames, recording.num_frames)
    start = (recording.num_frames - frames) // 2 if config.start is None else config.start
    if not 0 <= start < recording.num_frames:
        raise InputError(f"start={start}: must be from 0 to {recording.num_frames - 1}, the recording's last frame")
    return recording.frames[start], min(frames, recording.num_frames - start)


def _picture(recording: Recording, found: Examination):
    geometry = found.geometry
    return room_sheet(
        unit_rig(recording.rig, geometry.scale),
        found.pictures,
        recording.up,
        geometry.target / geometry.scale,
        1.0 / geometry.scale,
        recording.name,
    )


def _page(recording: Recording, found: Examination, start: int, frames: int) -> str:
    span = f"frames {start} to {start + frames - 1}" if frames > 1 else f"frame {start}"
    offsets = {name: offset for name, offset in found.offsets.items() if offset}
    subtitle = f"A check of {span}, {counted(len(recording.rig), 'camera')}"
    line = offsets_line(offsets) if offsets else ""
    return check_page(recording.name, subtitle, found.findings, _picture(recording, found), offsets, line)


def _offer_offsets(config: CheckConfig, recording: Recording, found: Examination) -> None:
    """Print the lines that correct the offsets, and write them on request."""
    if not found.offsets:
        if config.write:
            say("write=true: no time offset was found, so recording.yaml stays as it is")
        return
    offsets = {name: offset for name, offset in found.offsets.items() if offset}
    print(offsets_line(offsets))
    if config.write:
        path = SETTINGS.of(recording.path)
        kept = write_frame_offsets(path, offsets)
        say(f"{path}: frame_offset was written{'' if kept is None else f'; the previous file is {kept}'}")
