"""The settings of live tracking: where pictures come from, what is tracked, and who is told."""

from dataclasses import dataclass
from typing import Any

from sogjax.settings.method import ColorConfig, EnergyConfig, ImagesConfig, SolverConfig, TrackingConfig
from sogjax.settings.option import REQUIRED, expert, group, option
from sogjax.settings.run import OVERWRITE


@dataclass
class FaultsConfig:
    """What goes wrong with the cameras of a replay: a test bench."""

    drop: float = expert(0.0, "share of the pictures of each camera that never arrive, 0 to 1")
    delay: Any = expert(None, "{CAMERA:SECONDS}: pictures that arrive late; null: none")
    jitter: float = expert(0.0, "s: standard deviation of the time by which each picture arrives later")
    gone: Any = expert(None, "{CAMERA:[FROM,TO]}: seconds of the replay in which a camera gives nothing; null: none")
    seed: int = expert(0, "of what is drawn at random")


@dataclass
class LiveConfig:
    """Track while pictures arrive, from cameras or a replayed recording, and pass every pose on."""

    preset: str = option("default", "default | paper: all settings at once; those given individually take precedence")
    recording: str = option(REQUIRED, "folder with the calibration and background of the cameras, or a recording")
    actor: Any = option(None, "actor file, or a list of them; null: only with learn_background=true")
    sources: Any = option(
        None,
        "{CAMERA:SOURCE}: a device number, or what OpenCV opens: an address (rtsp://, http://) or a GStreamer pipeline",
    )
    replay: bool = option(False, "replay the recording at its own rate, in place of cameras")
    speed: float = expert(1.0, "of a replay, as a multiple of the recording's rate")
    loop: bool = option(False, "a replay begins again when it has ended")
    search: bool = expert(
        False, "search for the first pose of a replay while it runs, as with cameras; false: before it begins"
    )
    fps: float | None = option(None, "pictures per second of the cameras; null: the recording's, else 30")
    seconds: float | None = option(None, "how long to track; null: until Ctrl-C, or the end of a replay")
    out: str = option("", "folder for motion.npz and live.json; default: outputs/RECORDING_live")
    record: str | None = option(None, "folder to keep the videos in, as a recording to track again; null: none")
    learn_background: bool = option(False, "learn background/CAMERA.png from ten seconds of the empty place, and end")
    vmc: str | None = option(None, "HOST:PORT that gets the avatar by VMC, such as 127.0.0.1:39539; null: none")
    json: str | None = option(
        None, "HOST:PORT (UDP), the path of a local datagram socket, or - (the terminal), for lines of JSON; null: none"
    )
    rerun: str | None = option(
        None, "viewer: open Rerun's viewer | HOST:PORT of one that is open | FILE.rrd to write; null: none"
    )
    lsl: str | None = expert(None, "name of a Lab Streaming Layer stream of joint positions (extra `lsl`); null: none")
    cameras: list[str] | None = option(None, "cameras to use; null: all")
    overwrite: bool = option(False, OVERWRITE)
    iterations: int = expert(
        8, "most iterations of the solver at a time: the next frame goes on from there, and none makes others late"
    )
    wait: float = expert(0.5, "how long a late camera is waited for, in frames")
    faults: FaultsConfig = group(FaultsConfig, "")
    color: ColorConfig = group(ColorConfig, "")
    images: ImagesConfig = group(ImagesConfig, "")
    energy: EnergyConfig = group(EnergyConfig, "")
    solver: SolverConfig = group(SolverConfig, "")
    tracking: TrackingConfig = group(TrackingConfig, "")
