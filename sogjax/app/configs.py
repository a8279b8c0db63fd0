"""Hydra schemas of the commands: the only place where defaults stand; the YAML files of `conf/` hold deltas.

Every field carries its help text; `--help` prints it. Symbols in brackets are the paper's.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any

from omegaconf import MISSING

OVERWRITE = "replace what an earlier run wrote there"


def option(default: Any, help_text: str) -> Any:
    """A config field with its default and the text that `--help` prints."""
    return field(default=default, metadata={"help": help_text})


def group(schema: Callable[[], Any], help_text: str) -> Any:
    """A config group, or a list, made by a schema or function."""
    return field(default_factory=schema, metadata={"help": help_text})


@dataclass
class ColorConfig:
    """Colour space and similarity (Eq. 7)."""

    space: str = option("hsv_cylinder", "hsv_cylinder | hsv_cone | hsv (the paper's) | rgb | lab")
    radius: float | None = option(None, "[eps_sim] colours farther apart do not match; null: the space's own")


@dataclass
class ImagesConfig:
    """Pictures to Sums of Gaussians (Section 4.1) and culling (Section 6)."""

    depth: int = option(8, "levels of the quad-tree below its root, the smallest power of two that holds a picture")
    color_tolerance: float = option(0.1, "[eps_col] a node splits above this standard deviation; < 0: always")
    box_enlargement: float = option(0.15, "border around an actor's box, as a part of its size")
    use_plates: bool | None = option(
        None, "leave out image blobs that equal the empty background pictures; null: where every camera has one"
    )
    plate_tolerance: float = option(0.1, "colours nearer than this to the plate's are background")
    cache: str | None = option(
        None, "folder where averaged pictures are kept, so that later runs decode no video; null: none are kept"
    )


@dataclass
class EnergyConfig:
    """The energy (Eq. 10)."""

    limit_weight: float = option(1.0, "[w_l] weight of the joint limits, 1/rad^2")
    acceleration_weight: float = option(0.01, "[w_a] weight of smooth motion, 1/rad^2")
    overlap_exponent: str = option("exact", "exact | printed: Eq. 6 with or without the 1/2 that Eq. 2 implies")
    capped: bool = option(True, "the cap of Eq. 8 against blobs that hide each other")
    pairs: str = option("sparse", "dense: all pairs of blobs | sparse: those near each other, the same to 1e-4")
    gradient: str = option("forward", "forward: closed form beside the value | autodiff: plain reverse mode")
    terms: Any = option(None, "further terms, {NAME:{term:MODULE.CLASS,weight:1}} with the class's numbers; null: none")


@dataclass
class SolverConfig:
    """The solver (Eq. 11, 12)."""

    method: str = option(
        "gauss_newton", "conditioned_ascent | gradient_ascent | gauss_newton | bfgs | lbfgs | nonlinear_cg"
    )
    epsilon: float = option(0.01, "[epsilon] stop when a step is shorter, rad and m; other solvers: 0.002")
    min_iterations: int = option(1, "[n_iter] iterations made at least; other solvers: 10")
    max_iterations: int = option(50, "iterations made at most; other solvers: 200")
    grow: float = option(1.2, "[mu+] growth of a step size while the gradient keeps its sign")
    shrink: float = option(0.5, "[mu-] shrinkage where it does not")
    first_angle: float = option(0.02, "[sigma_0] length of the first step of the angles, rad")
    first_translation: float = option(0.01, "[sigma_0] length of the first step of the translations, m")
    largest_angle: float = option(0.15, "bound on a step of an angle, rad")
    largest_translation: float = option(0.05, "bound on a step of a translation, m")


@dataclass
class TrackingConfig:
    """Prediction and the first frame (Section 5.3)."""

    extrapolation: float = option(0.5, "[alpha] part of the last motion that is added to predict the next pose")


@dataclass
class OutputsConfig:
    """What is written beside the motion."""

    overlay: bool = option(True, "overlay.mp4, the skeleton on every camera's pictures")
    overlay_width: int = option(1920, "width of the overlay video, px")
    rerun: bool = option(True, "motion.rrd, for the Rerun viewer")
    rerun_images: bool = option(True, "put the pictures into motion.rrd")
    bvh: bool = option(True, "motion.bvh")
    formats: list[str] | None = option(None, "further formats of the motion, some of [trc,c3d,glb,csv]; null: none")
    confidence: bool = option(
        False, "standard deviations of the pose and the joints, in motion.npz; rough, see experiments/confidence.py"
    )
    temperature: float = option(
        1e-5,
        "energy that counts as one unit of log-likelihood, for the standard deviations; by experiments/confidence.py",
    )


@dataclass
class TrackConfig:
    """Track the actors of a recording."""

    recording: str = option(MISSING, "folder of the recording")
    out: str = option("", "folder for the results; default: outputs/RECORDING")
    actor: Any = option(None, "actor file, or a list of them; null: made from the example poses")
    body: str = option("human", "body that actors are made from: human, dog, or a body file")
    initial_pose: str | None = option(
        None, "auto: search for it | file with a rough pose; null: the recording's initial_pose.yaml, else auto"
    )
    start: int = option(0, "first frame to track, counted from the recording's first")
    stop: int | None = option(None, "frame before which to stop; null: the end")
    cameras: list[str] | None = option(None, "cameras to use; null: all")
    resume: bool = option(False, "go on with the run that was stopped in this folder")
    overwrite: bool = option(False, OVERWRITE)
    sweep: str = option(
        "each", "with -m: each: one run after the other | vmapped: numbers only, all in one compiled call"
    )
    color: ColorConfig = group(ColorConfig, "")
    images: ImagesConfig = group(ImagesConfig, "")
    energy: EnergyConfig = group(EnergyConfig, "")
    solver: SolverConfig = group(SolverConfig, "")
    tracking: TrackingConfig = group(TrackingConfig, "")
    outputs: OutputsConfig = group(OutputsConfig, "")


@dataclass
class ActorConfig:
    """Make an actor file from the example poses of a recording."""

    recording: str = option(MISSING, "folder of the recording")
    out: str = option(MISSING, "actor file to write")
    subject: str | None = option(None, "which subject, where the recording has several")
    symmetric: bool = option(True, "left and right limbs have the same lengths and sizes")
    body: str = option("human", "body to start from: human, dog, or a body file")
    cameras: list[str] | None = option(None, "cameras to use; null: all")
    overwrite: bool = option(False, OVERWRITE)
    color: ColorConfig = group(ColorConfig, "")
    energy: EnergyConfig = group(EnergyConfig, "")


@dataclass
class BodyConfig:
    """Make a body file from the skeleton of another program."""

    from_: str = option(MISSING, "skeleton: a .skeleton of Skeletool, or a .bvh, of which the hierarchy is read")
    out: str = option(MISSING, "body file to write; for body= of the other commands, or to be edited first")
    dof: str | None = option(None, "a .dof of Skeletool, whose degrees of freedom replace those of the .skeleton")
    unit: str | None = option(None, "m | cm | mm: the file's lengths; null: mm of a .skeleton, m of a .bvh")
    up: str = option("y", "vertical of the file's rest pose: x y z -x -y -z")
    overwrite: bool = option(False, OVERWRITE)


@dataclass
class SegmentConfig:
    """Show the masks of the example poses: from files, else made from the empty background pictures."""

    recording: str = option(MISSING, "folder of the recording")
    out: str = option(MISSING, "folder for POSE/CAMERA.mask.png and one contact sheet a pose, POSE.png")
    subject: str | None = option(None, "which subject, where the recording has several")
    cameras: list[str] | None = option(None, "cameras to use; null: all")
    overwrite: bool = option(False, OVERWRITE)


@dataclass
class CheckConfig:
    """Look at a recording: calibration, synchronisation, exposure, files; say what is wrong and what to do."""

    recording: str = option(MISSING, "folder of the recording")
    out: str = option("", "folder for check.json and check.png, which are replaced; default: outputs/RECORDING/check")
    start: int | None = option(None, "first frame to look at, counted from the recording's first; null: the middle")
    frames: int = option(90, "frames to look at, at most; they should show somebody moving")
    largest_offset: int = option(15, "time offsets between cameras are looked for up to so many frames")
    write: bool = option(False, "write the time offsets that were found into recording.yaml, as frame_offset")
    cameras: list[str] | None = option(None, "cameras to look at; null: all")


@dataclass
class SynthConfig:
    """Render a recording with ground truth."""

    out: str = option(MISSING, "folder to write")
    motion: str = option("walk", "walk | arms | squat_kick | cartwheel | pass")
    actors: int = option(1, "number of people")
    cameras: int = option(12, "number of cameras in the ring")
    width: int = option(648, "width of the pictures, px")
    height: int = option(486, "height of the pictures, px")
    fps: float = option(30.0, "frames per second")
    frames: int = option(60, "number of frames")
    seed: int = option(0, "person, clothes, room and noise")
    noise: float = option(0.012, "standard deviation of the sensor noise, of full scale")
    overwrite: bool = option(False, "replace a rendered recording that is there")


@dataclass
class DemoConfig:
    """Render a person, make the actor, track, evaluate: everything at once."""

    out: str = option("outputs/demo", "folder for the results; those of an earlier demo are replaced")
    motion: str = option("walk", "walk | arms | squat_kick | cartwheel")
    cameras: int = option(12, "number of cameras")
    frames: int = option(60, "number of frames")
    width: int = option(648, "width of the pictures, px")
    height: int = option(486, "height of the pictures, px")
    seed: int = option(0, "person, clothes, room and noise")
    resume: bool = option(False, "go on with the demo that was stopped in this folder")
    overwrite: bool = option(False, OVERWRITE)
    outputs: OutputsConfig = group(OutputsConfig, "")


@dataclass
class ReportConfig:
    """Run the experiments of the paper's Section 6 and more, and write report.html and report.md; resumes."""

    out: str = option("outputs/report", "folder for the report and its runs; a run that is there is not done again")
    only: list[str] | None = option(
        None, "experiments, by their names in conf/experiment or as files FOLDER/NAME.yaml; null: all"
    )
    recordings: list[str] = group(
        lambda: [f"{motion}:{seed}" for motion in ("walk", "arms", "squat_kick", "cartwheel") for seed in (0, 1)],
        "folders of recordings with ground truth, or MOTION:SEED of rendered ones",
    )
    frames: int = option(40, "frames of each recording to track, at most")
    body: str = option("human", "body that the actors are made from, as for actor")
    overrides: list[str] = group(
        lambda: [], "options of track for all runs, of color, images, energy, solver or tracking: [solver=lbfgs]"
    )
    pictures: int = option(6, "worst frames to show")
    note: str = option("", "a sentence for the beginning of the report, such as what else the machine did")
    do: bool = option(True, "do the runs that are missing; false: report on those that are there")


@dataclass
class EvaluateConfig:
    """Compare a motion with ground truth (Section 6)."""

    motion: Any = option(MISSING, "motion.npz, or a list of them with several actors")
    truth: str = option(MISSING, "ground_truth.npz, or the folder of a recording that has one")
    out: str | None = option(None, "metrics.json to write; null: only print")
    overwrite: bool = option(False, OVERWRITE)


@dataclass
class ViewConfig:
    """Write or open the Rerun recording of a motion."""

    motion: Any = option(MISSING, "motion.npz, or a list of them with several actors")
    recording: str = option(MISSING, "folder of the recording")
    out: str | None = option(None, "motion.rrd to write; null: open the viewer")
    images: bool = option(True, "with the pictures")
    overwrite: bool = option(False, OVERWRITE)


@dataclass
class ExportConfig:
    """Write a motion, or a calibration, in another format."""

    motion: str | None = option(None, "motion.npz, or a .motion of Skeletool")
    calibration: str | None = option(None, "calibration file, or the folder of a recording; instead of a motion")
    to: str = option(
        MISSING,
        "file to write; its ending says the format: .bvh .trc .c3d .glb .csv .motion .npz; "
        "of a calibration: .toml .calibration",
    )
    up: str | None = option(None, "vertical of the motion's world: x y z -x -y -z; null: what the motion says")
    actor: str | None = option(None, "actor or body file of the motion; only a .motion needs it, read or written")
    fps: float | None = option(None, "frames per second; only a .motion that is read needs it")
    overwrite: bool = option(False, OVERWRITE)


def option_key(name: str) -> str:
    """The key of a field on the command line: Python's own words stand in the schemas with a line after them."""
    return name.removesuffix("_")


@dataclass
class DoctorConfig:
    """Look at the installation: versions, devices, extras, speed of the disk, and a test of five seconds."""

    folder: str = option(".", "folder whose write speed is measured")


def help_lines(schema: type, prefix: str = "") -> list[tuple[str, str, str]]:
    """(key, default, text) of every option of a schema, groups unfolded."""
    lines: list[tuple[str, str, str]] = []
    example = schema()
    for entry in fields(schema):
        default = getattr(example, entry.name)
        if is_dataclass(default):
            lines += help_lines(type(default), f"{prefix}{entry.name}.")
        else:
            shown = "required" if default == MISSING else "null" if default is None else str(default)
            lines.append((prefix + option_key(entry.name), shown, entry.metadata["help"]))
    return lines
