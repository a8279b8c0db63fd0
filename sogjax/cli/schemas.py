"""The commands and their settings, those of tracking and actors apart (`sogjax.settings.run`).

Every field carries its help text; `--help` prints it. Symbols in brackets are the paper's.
"""

from dataclasses import dataclass
from typing import Any

from sogjax.settings.live import LiveConfig
from sogjax.settings.option import REQUIRED, group, option
from sogjax.settings.run import OVERWRITE, ActorConfig, AdjustConfig, OutputsConfig, TrackConfig
from sogjax.study.settings import ReportConfig
from sogjax.synth.detector import DetectorSettings
from sogjax.synth.settings import SynthSettings

_RENDERED = SynthSettings()


@dataclass
class BodyConfig:
    """Make a body file from another program's skeleton."""

    from_: str = option(REQUIRED, "skeleton: a .skeleton of Skeletool, or a .bvh, whose hierarchy is read")
    out: str = option(REQUIRED, "body file to write; for body= of the other commands, or to be edited first")
    dof: str | None = option(None, "a .dof of Skeletool, whose degrees of freedom replace those of the .skeleton")
    unit: str | None = option(None, "m | cm | mm: the file's lengths; null: mm of a .skeleton, m of a .bvh")
    up: str = option("y", "vertical of the file's rest pose: x y z -x -y -z")
    overwrite: bool = option(False, OVERWRITE)


@dataclass
class SegmentConfig:
    """Show what tells the subject from the room: masks of the example poses, and the background of every camera."""

    recording: str = option(REQUIRED, "folder of the recording")
    out: str = option(
        REQUIRED,
        "folder for POSE/CAMERA.mask.png, a contact sheet per pose, POSE.png, background/CAMERA.png, and "
        "occluders.png where something was painted to stand in front",
    )
    frames: list[int] | None = option(
        None, "frames whose probability of foreground is shown; null: none, or three if there are no example poses"
    )
    background: str = option(
        "auto", "pictures: of the empty scene | clip: learnt from the clip | auto: those there are, else the clip"
    )
    subject: str | None = option(None, "which subject, if the recording has several")
    cameras: list[str] | None = option(None, "cameras to use; null: all")
    overwrite: bool = option(False, OVERWRITE)


@dataclass
class CheckConfig:
    """Check a recording: calibration, synchronisation, exposure, files; say what is wrong and what to do."""

    recording: str = option(REQUIRED, "folder of the recording")
    out: str = option("", "folder of check.json and index.html, overwritten if there; default: outputs/RECORDING/check")
    start: int | None = option(None, "first frame to examine, counted from the recording's first; null: the middle")
    frames: int = option(90, "frames to examine, at most; somebody should be moving in them")
    largest_offset: int = option(15, "largest time offset between cameras to look for, frames")
    write: bool = option(False, "write the time offsets found into recording.yaml, as frame_offset")
    cameras: list[str] | None = option(None, "cameras to examine; null: all")
    body: str | None = option(
        None, "body or actor that is to be tracked, by name or file, by whose size lengths are judged; null: a person"
    )
    overwrite: bool = option(False, "accepted as by other commands; an earlier check is replaced in any case")


@dataclass
class SynthConfig(DetectorSettings, SynthSettings):
    """Render a recording with ground truth."""

    out: str = option(REQUIRED, "folder to write")
    overwrite: bool = option(False, "replace an existing rendered recording")


@dataclass
class DemoConfig:
    """Render a person, make the actor, track, evaluate: everything at once."""

    out: str = option("outputs/demo", "folder for the results; those of an earlier demo are replaced")
    motion: str = option(_RENDERED.motion, "walk | arms | squat_kick | cartwheel")
    cameras: int = option(_RENDERED.cameras, "number of cameras")
    frames: int = option(_RENDERED.frames, "number of frames")
    width: int = option(_RENDERED.width, "width of the pictures, px")
    height: int = option(_RENDERED.height, "height of the pictures, px")
    seed: int = option(_RENDERED.seed, "person, clothes, room and noise")
    resume: bool = option(False, "resume the demo that was stopped in this folder")
    overwrite: bool = option(False, OVERWRITE)
    outputs: OutputsConfig = group(OutputsConfig, "")


@dataclass
class EvaluateConfig:
    """Compare a motion with ground truth (Section 6), or with another system's motion."""

    motion: Any = option(REQUIRED, "motion.npz, or a list of them with several actors")
    truth: str = option(
        REQUIRED,
        "ground_truth.npz, or the folder of a recording that has one; or another system's .mot .sto .trc .c3d .bvh",
    )
    out: str | None = option(None, "metrics.json to write; null: only print")
    offset: float | None = option(
        None, "seconds to add to the times of another system; null: found by cross-correlation"
    )
    markers: str = option(
        "scaled",
        "markers go with the closest blob's joint; scaled: distances in the blob's sigmas | closest: as in Section 6",
    )
    overwrite: bool = option(False, OVERWRITE)


@dataclass
class ViewConfig:
    """Write or open the Rerun recording of a motion, or write a picture of it, which needs no display."""

    motion: Any = option(REQUIRED, "motion.npz, or a list of them with several actors")
    recording: str = option(REQUIRED, "folder of the recording")
    out: str | None = option(None, "motion.rrd or picture.png to write; null: open the viewer")
    frame: int | None = option(None, "frame of a picture, by the recording's numbers; null: the middle")
    images: bool = option(True, "with the pictures")
    overwrite: bool = option(False, OVERWRITE)


@dataclass
class ExportConfig:
    """Write a motion, or a calibration, in another format."""

    motion: Any = option(
        None, "motion.npz, or a .motion of Skeletool; for a .yaml a list of motion_NAME.npz with several actors"
    )
    calibration: str | None = option(None, "calibration file, or the folder of a recording; instead of a motion")
    to: str = option(
        REQUIRED,
        "file to write; the ending gives the format: .bvh .trc .c3d .glb .csv .mot .motion .npz; "
        "one frame as an initial_pose.yaml: .yaml; of a calibration: .toml .calibration",
    )
    frame: int | None = option(None, "frame whose pose a .yaml holds, by the recording's numbers; null: the first")
    up: str | None = option(None, "vertical of the motion's world: x y z -x -y -z; null: what the motion says")
    actor: str | None = option(None, "actor or body file of the motion; only needed to read or write a .motion")
    fps: float | None = option(None, "frames per second; only needed to read a .motion")
    markers: str | None = option(
        None,
        "points of a .trc or .c3d; null: joint centres, toes, heels, hands, head top | all: every bone, too | "
        "a keypoint scheme by name or file: HALPE_26 for Pose2Sim's next steps",
    )
    dialect: str | None = option(
        None, "of a .bvh: null, the body's own joints in metres | lafan1, for robots: 22 joints by LAFAN1's names in cm"
    )
    angles: bool = option(False, "a .csv holds joint angles in degrees instead of positions, as a .mot always does")
    overwrite: bool = option(False, OVERWRITE)


@dataclass
class DoctorConfig:
    """Check the installation: versions, devices, extras, speed of the disk, and a five-second test."""

    folder: str = option(".", "folder whose writing speed is measured")
    overwrite: bool = option(False, "accepted as by other commands; nothing is written")


SCHEMAS: dict[str, type] = {
    "demo": DemoConfig,
    "track": TrackConfig,
    "adjust": AdjustConfig,
    "live": LiveConfig,
    "actor": ActorConfig,
    "body": BodyConfig,
    "segment": SegmentConfig,
    "check": CheckConfig,
    "evaluate": EvaluateConfig,
    "report": ReportConfig,
    "synth": SynthConfig,
    "view": ViewConfig,
    "export": ExportConfig,
    "doctor": DoctorConfig,
}
"""The commands and their schemas."""

MOTIONS = (
    *(".bvh", ".c3d", ".csv", ".glb", ".lafan1.bvh", ".lengths.csv", ".mot", ".motion", ".npz", ".trc"),
    *(".yaml", ".yml"),
)
CALIBRATIONS = (".toml", ".calibration")
FORMATS = tuple(ending[1:] for ending in MOTIONS if ending not in (".motion", ".npz", ".yaml", ".yml"))
"""The formats that `outputs.formats` may name."""
ENDINGS: dict[str, dict[str, tuple[str, ...]]] = {"view": {"out": (".rrd", ".png")}}
"""The endings of files that commands may write, by command and option; what is not given is not looked at."""
