"""The page of a run: what its passes left, put together for `sogjax.view.page`."""

import platform
import shlex
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, is_dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool

from sogjax.errors import InputError, counted
from sogjax.io.files import write_file
from sogjax.model.body import Body, dof_slices
from sogjax.model.limbs import limbs
from sogjax.quality.evaluation import points_dict
from sogjax.run.adjust_clip import sentence
from sogjax.run.clock import seconds_so_far
from sogjax.run.fingerprint import installed_version
from sogjax.run.result import RunResult
from sogjax.run.run import Run
from sogjax.run.run_files import ADJUSTMENT, MOTION, RERUN, RUN_FILES
from sogjax.run.small_pictures import WIDTH
from sogjax.run.terminal import say
from sogjax.settings.compose import track_config
from sogjax.view.page.pictures import FramePictures, Picture
from sogjax.view.page.run_page import ActorOnPage, RunOnPage, run_page

FRAMES_ON_PAGE = 64
"""Frames whose pictures the page shows, at most, besides the worst."""
PACKAGES = ("sogjax", "jax", "optimistix", "numpy", "scipy", "opencv-python-headless", "matplotlib", "rerun-sdk")


def write_page(path: Path, run: Run, worst: Mapping[int, Picture], images: Mapping[int, Sequence[Any]]) -> None:
    """Write the page of a run whose other files are written.

    Args:
        path: of the page.
        run: that has its result.
        worst: close-ups of the frames that fit worst.
        images: the pictures of these frames.
    """
    result, out = run.result, path.parent
    numbers = [int(number) for number in next(iter(result.motions.values())).frame]
    span = f"frames {numbers[0]} to {numbers[-1]}" if len(numbers) > 1 else f"frame {numbers[0]}"
    names = " and ".join(result.motions)
    what = "adjusted" if run.adjusted is not None else "tracked"
    cameras = counted(len(result.recording.rig), "camera")
    python = f"{platform.python_version()} ({platform.system()} {platform.machine()})"
    page = RunOnPage(
        title=result.recording.name,
        subtitle=f"{names} {what} in {span}, {cameras}, {datetime.now():%d %B %Y}",
        rig=result.recording.rig,
        actors=_actors(run, result),
        cameras=[*run.clip.small.cameras] if run.clip.small is not None else [],
        pictures=_pictures(run, images),
        width=WIDTH,
        worst=worst,
        numbers=_numbers(run, result),
        notes=_notes(run, result),
        settings=changed_settings(run.config),
        versions=[(name, found) for name in PACKAGES if (found := installed_version(name))] + [("python", python)],
        files=_files(out),
        commands=_commands(run, out, result),
        links=_links(out),
    )
    write_file(path, run_page(page))


def _actors(run: Run, result: RunResult) -> list[ActorOnPage]:
    evaluations = {} if result.evaluation is None else result.evaluation.evaluations
    revised = revised_limbs(run, result.bodies)
    found = []
    for body, changed in zip(result.bodies, revised, strict=True):
        points = evaluations.get(body.name)
        table = points_dict(points.markers or points.joints) if points is not None else None
        rows = [] if table is None else [("all", f"{table['mean_mm']:.1f}", f"{table['std_mm']:.1f}")]
        rows += [
            (name.replace("_", " "), f"{each['mean_mm']:.1f}", f"{each['std_mm']:.1f}")
            for name, each in ({} if table is None else table["per_point"]).items()
        ]
        motion = result.motions[body.name]
        found.append(ActorOnPage(motion, body, result.verdicts[body.name], changed, rows))
    return found


def revised_limbs(run: Run, bodies: Sequence[Body]) -> list[Bool[np.ndarray, "frame limb"] | None]:
    """Of each actor, the limbs that a pass after tracking found elsewhere; None: there was none, or it is not known."""
    tracked = run.records.get("tracked")
    before, after = (None if tracked is None else tracked.table.pose), run.records.get("merged")
    found: list[Bool[np.ndarray, "frame limb"] | None] = []
    for body, dofs in zip(bodies, dof_slices(bodies), strict=True):
        parts = limbs(body.skeleton)
        if before is None or after is None:
            found.append(None)
            continue
        moved = np.abs(after.table.pose[:, dofs] - before[:, dofs]) > 1e-4
        found.append(np.stack([moved[:, part].any(axis=1) for part in parts], axis=1) if parts else moved[:, :0])
    return found


def _pictures(run: Run, worst: Mapping[int, Sequence[Any]]) -> Iterator[FramePictures]:
    """The small pictures, and those of the worst frames, in the order of time."""
    small = run.clip.small
    if small is None:
        return
    try:
        small.read_lacking()
    except InputError as error:
        say(f"warning: some pictures are not on the page: {error}")
    frames = sorted({*small.frames, *worst})
    with ThreadPoolExecutor() as threads:  # JPEGs are decoded beside each other
        shown = threads.map(lambda frame: worst[frame] if frame in worst else small.of_frame(frame), frames)
        for frame, images in zip(frames, shown, strict=True):
            if any(image is not None for image in images):
                yield frame, images


def _numbers(run: Run, result: RunResult) -> list[tuple[object, ...]]:
    frames = len(result.converged)
    rows: list[tuple[object, ...]] = [
        ("frames", frames),
        ("frames per second of the recording", f"{result.recording.fps:g}"),
        ("cameras", ", ".join(result.recording.rig.names)),
        ("initial pose from", run.initial_pose.source) if "initial_pose" in run.records else (),
        ("iterations of the solver, per frame", f"{float(np.mean(result.iterations)):.1f}"),
        ("frames in which it did not converge", int(np.sum(~result.converged))),
    ]
    rows += [(f"seconds: {stage}", f"{seconds:.1f}") for stage, seconds in seconds_so_far().items() if seconds >= 0.05]
    return [row for row in rows if row]


def _notes(run: Run, result: RunResult) -> list[str]:
    frames = counted(len(result.converged), "frame")
    notes = [
        f"{camera} had no picture in {count} of {frames}; the others were used"
        for camera, count in result.missing.items()
    ]
    motion = next(iter(result.motions.values()))
    if motion.filtered_by:
        notes.append(f"Filtered: {motion.filtered_by}. motion.npz keeps the poses before it, as unfiltered_pose.")
    if run.adjusted is not None:
        notes.append(f"{sentence(run.adjusted.numbers).strip().replace(chr(10), '; ')} ({ADJUSTMENT.name})")
    if result.evaluation is None:
        notes.append("There is no ground truth: what is said here rests on what the pictures show.")
    return notes


def changed_settings(config: Any) -> list[tuple[str, str, str]]:
    """The settings that are not the defaults: key, value and default."""
    here, usual = _flat(config), _flat(track_config(recording=config.recording))
    shown = lambda value: "null" if value is None else str(value)
    return [(key, shown(value), shown(usual.get(key))) for key, value in here.items() if value != usual.get(key)]


def _flat(config: Any, prefix: str = "") -> dict[str, Any]:
    found: dict[str, Any] = {}
    for entry in fields(config):
        value = getattr(config, entry.name)
        found |= _flat(value, f"{prefix}{entry.name}.") if is_dataclass(value) else {prefix + entry.name: value}
    return found


def _files(out: Path) -> list[tuple[str, str]]:
    names = sorted(path.name for path in out.iterdir() if path.is_file())
    holds = {name: next((each.holds for each in RUN_FILES if each.matches(name)), "") for name in names}
    return [(name, what) for name, what in holds.items() if what]


def _commands(run: Run, out: Path, result: RunResult) -> list[tuple[str, str]]:
    """What may be done next, as one types it where the run was begun."""
    recording, count = shlex.quote(run.config.recording), len(result.motions)
    first = next(iter(result.motions))
    motion, rerun = shlex.quote(str(MOTION.of(out, first, count))), RERUN.of(out)
    look = f"rerun {shlex.quote(str(rerun))}"
    if not rerun.is_file():
        look = f"sogjax view motion={shlex.quote(str(out))} recording={recording}"
    found = [("Look at it in 3-D, in Rerun:", look)]
    if run.adjusted is None and count == 1:
        words = f"sogjax adjust motion={shlex.quote(str(out))} recording={recording}"
        found.append(("Adjust poses and the actor's shape together, from all frames at once:", words))
    found.append(("Take it to OpenSim (.trc, .mot), Blender (.bvh, .glb), a spreadsheet (.csv):",
                  f"sogjax export motion={motion} to=motion.trc"))  # fmt: skip
    if result.recording.ground_truth is not None:
        words = f"sogjax evaluate motion={motion} truth={shlex.quote(str(result.recording.ground_truth))}"
        found.append(("Compare it with the truth, point by point:", words))
    found.append(("Check the recording, where something looks wrong:", f"sogjax check recording={recording}"))
    return found


def _links(out: Path) -> dict[str, str]:
    reports = sorted(out.glob("actor*_report/index.html"))
    words = lambda path: path.parent.name.removesuffix("_report").replace("_", " ")
    return {f"How the {words(path)} was made": path.relative_to(out).as_posix() for path in reports}
