"""The motions of the actors of a table of frames; also of one that still grows in the folder of a run."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import count
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body
from sogjax.io.files import write_file
from sogjax.io.frame_table import FrameTable, read_frames_log
from sogjax.io.motion import Motion, load_motion, motion_from_poses
from sogjax.io.recording import Recording
from sogjax.model.body import Body, dof_slices
from sogjax.model.limbs import joint_limbs, limb_names, limb_slices
from sogjax.model.rotation import world_from_upright

FRAMES, FACTS, ACTOR = "frames", "clip.json", "actor_{}.yaml"
"""Names in the folder of a run that has not ended: the log of its frames, what they are of, and the actors."""
PARTIAL = "run.partial"
"""The folder itself, in that of the results."""


MOSTLY_HIDDEN = 0.7
"""Part of a limb that must be hidden from the cameras for its place to be doubted, the more the less is seen."""
UNSEEN_DOUBT = 0.6
"""Doubt of a limb that no camera sees: it is kept by prediction and limits, which is more likely wrong than right."""


@dataclass(frozen=True)
class ClipFacts:
    """What motions have to know of the clip that they were found in."""

    fps: float
    """Of the recording, whose numbers frames have, however few of them are tracked."""
    up: str
    cameras: tuple[str, ...]

    @classmethod
    def of(cls, recording: Recording) -> "ClipFacts":
        """The facts of a recording."""
        return cls(recording.fps, recording.up, recording.rig.names)

    def save(self, folder: Path) -> None:
        """Keep them in the folder of a run."""
        write_file(folder / FACTS, json.dumps(asdict(self)))


def with_hidden(
    doubt: Float[np.ndarray, "frame limb"], hidden: Float[np.ndarray, "frame limb"] | None
) -> Float[np.ndarray, "frame limb"]:
    """Doubts of limbs, of which those that are mostly hidden cannot be sure."""
    if hidden is None:
        return doubt
    unseen = np.clip((hidden - MOSTLY_HIDDEN) / (1.0 - MOSTLY_HIDDEN), 0.0, 1.0)
    return np.maximum(doubt, UNSEEN_DOUBT * unseen)


def motions_of(table: FrameTable, bodies: Sequence[Body], clip: ClipFacts) -> dict[str, Motion]:
    """The motion of each actor, upright in the world; similarity, energy and iterations are those of all together."""
    found = {}
    parts = zip(bodies, dof_slices(bodies), limb_slices(bodies), strict=True)
    for actor, (body, dofs, limbs) in enumerate(parts):
        judged: dict[str, Any] = {}
        if table.limb_doubt is not None and table.explained is not None and table.overlap is not None:
            of_limbs = lambda column, limbs=limbs: None if column is None else np.asarray(column[:, limbs], float)
            hidden = of_limbs(table.limb_hidden)
            judged = {
                "limb_names": limb_names(body),
                "joint_limb": joint_limbs(body.skeleton),
                "limb_doubt": with_hidden(np.asarray(table.limb_doubt[:, limbs], float), hidden),
                "limb_unlike": of_limbs(table.limb_unlike),
                "limb_rival": of_limbs(table.limb_rival),
                "limb_hidden": hidden,
                "explained": np.asarray(table.explained[:, actor], float),
                "overlap": np.asarray(table.overlap[:, actor], float),
                "camera_names": clip.cameras,
            }
        found[body.name] = motion_from_poses(
            body,
            table.pose[:, dofs],
            clip.fps,
            frame=table.frame,
            similarity=np.asarray(table.terms["similarity"], float),
            energy=np.asarray(table.energy, float),
            iterations=np.asarray(table.iterations, int),
            converged=np.asarray(table.converged, bool),
            up=clip.up,
            unfiltered_pose=None if table.unfiltered_pose is None else table.unfiltered_pose[:, dofs],
            **judged,
        )
    return found


def partial_motions(folder: Path) -> dict[str, Motion]:
    """The motions so far of a run that has not ended, by actor, from its folder `run.partial`.

    Raises:
        InputError: the folder holds no frames yet, or nothing that can be read.
    """
    table = read_frames_log(folder / FRAMES)
    if table is None:
        raise InputError(f"{folder}: holds no tracked frames yet; let the run go on (resume=true)")
    try:
        facts = json.loads((folder / FACTS).read_text(encoding="utf-8"))
        clip = ClipFacts(float(facts["fps"]), str(facts["up"]), tuple(facts["cameras"]))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{folder / FACTS}: cannot be read ({error}); let the run go on (resume=true)") from error
    bodies = []
    for k in count():
        if not (folder / ACTOR.format(k)).is_file():
            break
        body = load_body(folder / ACTOR.format(k))
        bodies.append(body.rotated(jnp.asarray(world_from_upright(clip.up), body.blob_sigmas.dtype)))
    return motions_of(table, bodies, clip)


def load_motions(path: Path) -> dict[str, Motion]:
    """The motions of a file, or of a run's folder: those that it wrote, or where it has not ended, those so far.

    By actor, as the file says, or else its name (`motion_NAME.npz`).

    Raises:
        InputError: there is no motion, or one that cannot be read.
    """
    if path.name == PARTIAL:
        return partial_motions(path)
    if path.parent.name == PARTIAL:
        found = partial_motions(path.parent)
        if path.name not in found:
            raise InputError(f"{path.parent}: holds the motions of {', '.join(found)}, none of {path.name}")
        return {path.name: found[path.name]}
    written = [path]
    if path.is_dir():
        written = [path / "motion.npz"] if (path / "motion.npz").is_file() else sorted(path.glob("motion_*.npz"))
        if not written and (path / PARTIAL).is_dir():
            return partial_motions(path / PARTIAL)
        if not written:
            raise InputError(f"{path}: this folder holds no motion; give the folder of a run, or a file")
    motions = {file: load_motion(file) for file in written}
    return {_actor_of(file, motion): motion for file, motion in motions.items()}


def load_one_motion(path: Path) -> Motion:
    """The motion of a file, or of a run of one actor.

    Raises:
        InputError: there is none, it cannot be read, or there are several.
    """
    found = load_motions(path)
    if len(found) > 1:
        name = next(iter(found))
        of_one = path / name if path.name == PARTIAL else path / f"motion_{name}.npz"
        raise InputError(f"{path}: holds the motions of {', '.join(found)}; name one, such as {of_one}")
    return next(iter(found.values()))


def _actor_of(path: Path, motion: Motion) -> str:
    return motion.actor or path.stem.removeprefix("motion").removeprefix("_") or "actor"
