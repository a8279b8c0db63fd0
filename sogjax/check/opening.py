"""What keeps a recording from being opened: each file is checked on its own, so all problems are reported at once."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from sogjax.check.findings import Finding
from sogjax.errors import InputError
from sogjax.io.calibration.load import load_calibration
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.example_poses import check_size, find_background, find_example_poses
from sogjax.io.projects import Project, calibrations_of, named_as_sources, named_calibration, project_in
from sogjax.io.recording_files import BACKGROUND, EXAMPLE_POSES, RECORDING_FILES, SETTINGS
from sogjax.io.recording_settings import RecordingSettings, read_recording_settings
from sogjax.io.source import find_sources, look_at_source

Value = TypeVar("Value")


def opening_problems(path: Path, first: InputError) -> list[Finding]:
    """One finding for each file that is wrong; `first` is what opening the recording complained of."""
    said: list[str] = []

    def tried(look: Callable[[], Value]) -> Value | None:
        try:
            return look()
        except InputError as error:
            said.extend({str(error)}.difference(said))
            return None

    settings = tried(lambda: read_recording_settings(SETTINGS.of(path))) or RecordingSettings()
    project = tried(lambda: project_in(path)) or Project()
    settings = project.filled_in(settings)
    sources = tried(lambda: find_sources(path)) or {}
    rig = tried(lambda: _rig(path, settings, project))
    rig = named_as_sources(rig, sources, project) if rig is not None else None
    infos = {camera: tried(lambda source=source: look_at_source(source)) for camera, source in sources.items()}
    sizes = {camera: info.size for camera, info in infos.items() if info is not None}
    if rig is not None:
        calibrated, sized = rig.names, _of_known_size(rig, sizes, settings.cameras)
        for camera in sized.names:
            if camera in sizes:
                tried(lambda camera=camera: check_size(sources[camera], sizes[camera], sized, camera))
        tried(lambda: find_background(BACKGROUND.of(path), sized, calibrated))
        tried(lambda: find_example_poses(EXAMPLE_POSES.of(path), sized, calibrated, settings.example_poses, None))
    for part in RECORDING_FILES:
        tried(lambda part=part: part.checked(path))
    if str(first) not in said:
        said.insert(0, str(first))
    return [_finding(sentence) for sentence in said]


def _rig(path: Path, settings: RecordingSettings, project: Project) -> CameraRig | None:
    """The cameras, where it is clear which calibration counts; the recording's own opening complains otherwise."""
    given = settings.calibration
    named = [named_calibration(path, given, project)] if given else calibrations_of(path, project)
    return load_calibration(named[0], settings.unit) if len(named) == 1 else None


def _of_known_size(rig: CameraRig, sizes: Mapping[str, tuple[int, int]], used: Sequence[str] | None) -> CameraRig:
    """The cameras that are used and whose pictures have a known size: by the calibration, else by their videos."""
    rig = rig.with_sizes(sizes)
    widths = np.asarray(rig.cameras.image_size)[:, 0]
    known = [name for name, width in zip(rig.names, widths, strict=True) if not np.isnan(width)]
    return rig.select([name for name in known if used is None or name in used])


def _finding(sentence: str) -> Finding:
    if "is not a rotation matrix (determinant -1" in sentence:
        cause = "a mirrored world: axes that changed between left-handed and right-handed"
        return Finding("error", "calibration", sentence, cause, "export the calibration for right-handed axes")
    return Finding("error", "files", sentence)
