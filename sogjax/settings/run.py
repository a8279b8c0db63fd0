"""The settings of a run: what is tracked, with which method, and what is written; and those of an actor."""

from dataclasses import dataclass, fields, replace
from typing import Any

from sogjax.settings.method import ColorConfig, EnergyConfig, ImagesConfig, SolverConfig, TrackingConfig
from sogjax.settings.option import REQUIRED, expert, group, is_inert, option

OVERWRITE = "replace the results of an earlier run"


@dataclass
class OutputsConfig:
    """Files to write beside the motion."""

    motion_only: bool = option(
        False, "none of them: no overlay, no picture, no Rerun file, no other format, whatever they say", inert=True
    )
    page: bool = expert(True, "index.html, the whole result on one page for a browser", inert=True)
    overlay: bool = option(True, "overlay.mp4, the skeleton on every camera's pictures", inert=True)
    overlay_width: int = expert(
        1920, "largest width of the overlay video, px; its height is 9/16 of that at most", inert=True
    )
    rerun: bool = expert(True, "motion.rrd, for the Rerun viewer", inert=True)
    rerun_images: bool = expert(True, "put the pictures into motion.rrd", inert=True)
    bvh: bool = expert(True, "motion.bvh", inert=True)
    formats: list[str] | None = option(
        None, "further formats of the motion, some of [trc,c3d,glb,csv,mot,lafan1.bvh]; null: none", inert=True
    )
    filter: float | None = option(
        None,
        "Hz: low-pass filter over the whole motion, without delay (Butterworth, order 4): 3 to 6 for walking, 6 to 15 "
        "for running, more for blows; null: none",
    )
    pose2sim: bool = option(
        False,
        "PROJECT/pose-3d/TRIAL_FIRST-LAST.trc of a Pose2Sim project, which its next steps read (HALPE_26)",
        inert=True,
    )
    confidence: bool = expert(
        True, "how likely each limb is more than 10 cm off: in motion.npz, motion.rrd, the overlay and the summary"
    )

    def asked(self) -> "OutputsConfig":
        """The outputs, all files off where only the motion is asked for."""
        if not self.motion_only:
            return self
        files = {entry.name: entry.default for entry in fields(self) if is_inert(entry)}
        off = {name: False if usual is True else usual for name, usual in files.items()}
        return replace(self, **off | {"motion_only": True})


@dataclass
class TrackConfig:
    """Track the actors of a recording."""

    preset: str = option(
        "default", "default | paper: all settings at once; those given individually take precedence", inert=True
    )
    recording: str = option(REQUIRED, "folder of the recording; with -m several: A,B,C or 'glob(/data/*)'")
    out: str = option(
        "", "folder for the results; default: outputs/RECORDING; of several recordings the one around", inert=True
    )
    actor: Any = option(
        None,
        "actor file, or a list of them; of several recordings also a folder of SUBJECT.yaml; null: make it from the "
        "example poses",
    )
    actors: int | None = option(
        None, "how many people to make actors of, without example poses; null: one, or as many as files or poses name"
    )
    body: str = option("human", "body that actors are made from: human, dog, or a body file")
    initial_pose: str | None = option(
        None,
        "auto: a frame of the videos that the actor was made of, else a search | file with a rough pose; null: the "
        "recording's initial_pose.yaml, else such a frame, else its keypoints, else a search",
    )
    start: int = option(0, "first frame to track, counted from the recording's first")
    stop: int | None = option(None, "frame before which to stop; null: the end")
    every: int = expert(1, "how many frames lie from one that is tracked to the next")
    cameras: list[str] | None = option(None, "cameras to use; null: all")
    adjust: bool = option(
        False, "adjust poses and the actor's shape together at the end, as sogjax adjust; the clip is read again"
    )
    resume: bool = option(False, "resume the run that was stopped in this folder", inert=True)
    overwrite: bool = option(False, OVERWRITE, inert=True)
    color: ColorConfig = group(ColorConfig, "")
    images: ImagesConfig = group(ImagesConfig, "")
    energy: EnergyConfig = group(EnergyConfig, "")
    solver: SolverConfig = group(SolverConfig, "")
    tracking: TrackingConfig = group(TrackingConfig, "")
    outputs: OutputsConfig = group(OutputsConfig, "")


@dataclass
class ActorConfig:
    """Make an actor file from the example poses of a recording."""

    recording: str = option(REQUIRED, "folder of the recording")
    out: str = option(REQUIRED, "actor file to write")
    subject: str | None = option(None, "which subject, if the recording has several")
    actors: int | None = option(
        None, "how many people the videos show, without example poses: subject=person_1, person_2, ...; null: one"
    )
    symmetric: bool = option(True, "left and right limbs have the same lengths and sizes")
    body: str = option("human", "body to start from: human, dog, or a body file")
    cameras: list[str] | None = option(None, "cameras to use; null: all")
    overwrite: bool = option(False, OVERWRITE)
    color: ColorConfig = group(ColorConfig, "")


@dataclass
class AdjustConfig:
    """Adjust a tracked motion and the actor's shape together, from all frames at once."""

    motion: str = option(REQUIRED, "folder of a run of sogjax track, or its motion.npz")
    recording: str = option(REQUIRED, "folder of the recording in which it was tracked")
    out: str = option("", "folder for the results; default: outputs/RECORDING_adjusted")
    actor: str | None = option(None, "actor file of the motion; null: the run's")
    shape: bool = option(True, "adjust the shape, too; false: only the poses")
    cameras: bool = option(False, "look for cameras that stand or look elsewhere than the calibration says, too")
    offsets: bool = option(False, "look for cameras that are early or late by parts of a frame, too")
    window: int = option(60, "frames adjusted together; their pictures are kept in memory")
    overwrite: bool = option(False, OVERWRITE)
    outputs: OutputsConfig = group(OutputsConfig, "")
