"""What is worked on and looked at: recordings, rendered or one's own, their truth, and motions held against it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, overload

from sogjax.errors import InputError
from sogjax.io import frame_motions
from sogjax.io.ground_truth import GroundTruth, load_ground_truth
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.io.recording_files import GROUND_TRUTH
from sogjax.io.video import read_frames
from sogjax.quality.evaluation import Evaluation, GroupEvaluation, evaluate_motions
from sogjax.quality.markers import MarkerRule
from sogjax.run.build import marker_rule
from sogjax.run.recordings import opened
from sogjax.run.terminal import progress
from sogjax.settings.compose import composed_config
from sogjax.synth.cache import cached_recording
from sogjax.synth.settings import SynthSettings
from sogjax.view.projection import frame_range


def open_recording(path: str | Path, cameras: Sequence[str] | None = None) -> Recording:
    """The recording in a folder: calibration, videos, and what else is known; no picture is read yet.

    Lengths are metres in the calibration's world, whatever unit its files have. Warnings are printed on standard error,
    and stand in `recording.warnings`.

    Args:
        path: the folder, as the guide's page "From cameras to a motion" describes it.
        cameras: names of those to use; None: all.

    Raises:
        InputError: something is missing, unreadable or does not fit together, or there is no such camera.
    """
    return opened(str(path), cameras)


def render_recording(**settings: Any) -> Recording:
    """A rendered recording of walking or exercising people, with the truth about them.

    It is rendered once and kept in a cache folder (`SOGJAX_CACHE`, else the system's), from where it is opened when the
    same settings are asked for again. Sixty frames of twelve cameras take about half a minute.

    Args:
        settings: options of `sogjax synth`, such as `motion="walk", cameras=4, frames=20, width=324, height=244`.

    Raises:
        InputError: an unknown setting (with the nearest known one), a value out of range, or a folder that cannot be
            written.
    """
    wanted: SynthSettings = composed_config(SynthSettings, "synth", settings.items())
    return opened(str(cached_recording(wanted, progress=progress)))


def load_truth(source: Recording | str | Path) -> GroundTruth:
    """The markers (frame, marker, 3) and joints (frame, joint, 3) that were measured, in metres in the world.

    Row i is frame i of the recording; NaN where a marker was not seen. Either may be None.

    Args:
        source: a recording, its folder, or a file `ground_truth.npz`.

    Raises:
        InputError: there is none, or the file is damaged.
    """
    path = source.ground_truth if isinstance(source, Recording) else Path(source)
    if path is not None and path.is_dir():
        path = GROUND_TRUTH.of(path)
    if path is None or not path.exists():
        where = source.path if isinstance(source, Recording) else path
        raise InputError(
            f"{where}: there is no ground truth; give a recording with a {GROUND_TRUTH.name}, or such a file"
        )
    return load_ground_truth(path)


def load_motion(path: str | Path) -> Motion:
    """The motion of a file `motion.npz`, or of the folder in which a run that was stopped keeps its frames so far.

    Raises:
        InputError: no such file, another version, or an array that is missing, misshapen or not finite.
    """
    return frame_motions.load_one_motion(Path(path))


def write_rerun(path: str | Path, recording: Recording, motion: Motion | Sequence[Motion], images: bool = True) -> None:
    """Write a Rerun file (`rerun FILE` opens it): cameras, pictures, skeletons, blobs, curves and true markers.

    Args:
        path: the `.rrd` file; it is replaced as a whole.
        recording: in which was tracked.
        motion: one, or a list of them.
        images: whether the pictures are read and put into the file.

    Raises:
        InputError: the file cannot be written, a picture cannot be read, or frames that the recording does not have.
    """
    from sogjax.view.rerun import file as rerun

    shown = [motion] if isinstance(motion, Motion) else list(motion)
    first, stop = frame_range(recording, shown)
    rerun.write_rerun(
        Path(path),
        recording,
        shown,
        names=[each.actor for each in shown] if all(each.actor for each in shown) else None,
        frames=read_frames(recording, first, stop) if images else None,
        truth=None if recording.ground_truth is None else load_ground_truth(recording.ground_truth),
        progress=progress,
    )


Truth = Recording | GroundTruth | str | Path


@overload
def evaluate(motion: Motion, truth: Truth, markers: MarkerRule = ...) -> Evaluation: ...


@overload
def evaluate(motion: Sequence[Motion], truth: Truth, markers: MarkerRule = ...) -> GroupEvaluation: ...


def evaluate(
    motion: Motion | Sequence[Motion], truth: Truth, markers: MarkerRule = "scaled"
) -> Evaluation | GroupEvaluation:
    """How far a motion is from the truth, by virtual markers and joints (Section 6), with swaps of several actors.

    `print` shows the numbers in millimetres; `summary` has them in metres, `markers.errors` (frame, marker) and
    `joints.errors` (frame, joint) every single distance, in metres, NaN where the truth has no value.

    Args:
        motion: one, or a list of those of several actors, whose names are the truth's subjects.
        truth: as `load_truth` takes or gives it: a recording, its folder, a file, or the truth itself.
        markers: how markers are attached, `scaled` (to the blob that is nearest in its own sigmas) or `closest`
            (Section 6 to the letter: nearest by distance).

    Raises:
        InputError: there is no truth, it does not know an actor, or nothing can be compared.
    """
    rule = marker_rule(markers, "markers")
    known = truth if isinstance(truth, GroundTruth) else load_truth(truth)
    if isinstance(motion, Motion):
        name = next(iter(known.subjects)) if len(known.subjects) == 1 else motion.actor or "actor"
        return evaluate_motions({name: motion}, known, rule=rule).evaluations[name]
    if not all(each.actor for each in motion):
        raise InputError("motion: one of several does not say whose it is; set its `actor`")
    return evaluate_motions({each.actor: each for each in motion}, known, rule=rule)
