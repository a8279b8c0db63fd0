"""One motion, or several, held against a ground truth: as data, as JSON and as a table."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from sogjax.data.atomic import atomic_path
from sogjax.data.ground_truth import GroundTruth
from sogjax.data.motion import Motion
from sogjax.errors import InputError
from sogjax.evaluate.markers import PointErrors, common_frames, joint_errors, marker_errors
from sogjax.evaluate.metrics import (
    ErrorSummary,
    LostPoint,
    lost_points,
    mean_per_frame,
    mean_per_point,
    std_per_point,
    summarize,
)
from sogjax.evaluate.swaps import Swap, identity_swaps
from sogjax.sentences import counted

MM = 1000.0


@dataclass(frozen=True)
class Evaluation:
    """How far one motion is from the truth, over the frames that both have (metres)."""

    name: str
    frames: Int[np.ndarray, "frame"]
    """The recording's numbers of the evaluated frames."""
    markers: PointErrors | None
    """Section 6's virtual markers; each one's first frame counts, where it is 0 by construction."""
    joints: PointErrors | None
    lost: tuple[LostPoint, ...]

    def __str__(self) -> str:
        return self.table(details=False)

    @property
    def summary(self) -> ErrorSummary:
        """The numbers of the markers, or of the joints where the truth has no markers."""
        points = self.markers or self.joints
        return summarize(points.errors if points else np.zeros((len(self.frames), 0)))

    def as_dict(self) -> dict[str, Any]:
        """What `to_json` writes: millimetres, None where nothing was compared."""
        return {
            "name": self.name,
            "num_frames": len(self.frames),
            "first_frame": int(self.frames[0]),
            "last_frame": int(self.frames[-1]),
            "markers": _points_dict(self.markers),
            "joints": _points_dict(self.joints),
            "lost": [_in_mm(asdict(point), "mean") for point in self.lost],
        }

    def to_json(self, path: Path) -> None:
        """Write the numbers, per marker and per frame too, as JSON."""
        write_json(path, self.as_dict())

    def table(self, details: bool = True) -> str:
        """The numbers in millimetres as a plain-text table, with every marker and joint unless told otherwise."""
        lines = [_ROW.format(self.name or "mm", "mean", "std", "median", "95 %", "max", "<50", "<100")]
        for title, points in (("markers", self.markers), ("joints", self.joints)):
            if points is not None:
                lines.append(_summary_row(f"all {title}", summarize(points.errors)))
                rows = enumerate(points.names) if details else ()
                lines += [_summary_row(f"  {name}", summarize(points.errors[:, [k]])) for k, name in rows]
        lines.append(f"{counted(len(self.frames), 'frame')}, {self.frames[0]} to {self.frames[-1]}; distances in mm")
        if self.markers is not None:
            lines.append("markers are attached in their first frame: a wrong first pose shows in the joints only")
        lines += [
            f"lost: {p.name} in frames {p.first_frame} to {p.last_frame}, {MM * p.mean:.0f} mm" for p in self.lost
        ]
        return "\n".join(lines)


@dataclass(frozen=True)
class GroupEvaluation:
    """Several actors against the truth of one recording."""

    evaluations: dict[str, Evaluation]
    swaps: tuple[Swap, ...] = field(default=())

    def __str__(self) -> str:
        return self.table(details=False)

    @property
    def summary(self) -> ErrorSummary:
        """All actors' markers (else joints) together."""
        parts = [e.markers or e.joints for e in self.evaluations.values()]
        values = np.concatenate([p.errors.reshape(-1, 1) for p in parts if p is not None] or [np.zeros((0, 1))])
        frames: set[int] = set().union(*(map(int, e.frames) for e in self.evaluations.values()))
        return ErrorSummary(**{**asdict(summarize(values)), "num_frames": len(frames)})

    def as_dict(self) -> dict[str, Any]:
        """What `to_json` writes."""
        return {
            "all": summary_dict(self.summary),
            "subjects": {name: e.as_dict() for name, e in self.evaluations.items()},
            "swaps": [asdict(swap) for swap in self.swaps],
        }

    def to_json(self, path: Path) -> None:
        """Write the numbers of all actors as JSON."""
        write_json(path, self.as_dict())

    def table(self, details: bool = True) -> str:
        """The actors' tables below each other, then exchanged identities."""
        lines = [evaluation.table(details) for evaluation in self.evaluations.values()]
        lines += [
            f"swapped: {s.motion}'s motion follows {s.follows} in frames {s.first_frame} to {s.last_frame}"
            for s in self.swaps
        ]
        return "\n".join(lines)


def evaluate_motion(
    motion: Motion, truth: GroundTruth, name: str = "", joint_mapping: Mapping[str, str] | None = None
) -> Evaluation:
    """Compare one motion with the truth of its subject (names without a prefix).

    Args:
        motion: the tracked motion.
        truth: what it should be; see `GroundTruth.subject` where there are several subjects.
        name: title of the result.
        joint_mapping: truth's joint to motion's joint, for names that do not say it themselves.

    Raises:
        InputError: nothing can be compared.
    """
    rows, _ = common_frames(motion, truth)
    frames = np.asarray(motion.frame, int)[rows]
    markers = marker_errors(motion, truth)
    joints = joint_errors(motion, truth, joint_mapping)
    if markers is None and joints is None:
        raise InputError(
            f"none of the truth's joints ({', '.join(map(str, truth.joint_names))}) is a joint of the "
            "motion; give a joint mapping"
        )
    points = markers or joints
    lost = lost_points(points.errors, points.names, frames) if points else ()
    return Evaluation(name, frames, markers, joints, lost)


def evaluate_motions(
    motions: Mapping[str, Motion], truth: GroundTruth, joint_mapping: Mapping[str, str] | None = None
) -> GroupEvaluation:
    """Compare actors' motions, by name, with a truth whose names have the prefixes `NAME/`.

    A truth without prefixes is that of the only actor.

    Raises:
        InputError: an actor that the truth does not have; several actors, but a truth of one.
    """
    alone = len(motions) == 1 and not truth.subjects
    evaluations = {
        name: evaluate_motion(motion, truth if alone else truth.subject(name), name, joint_mapping)
        for name, motion in motions.items()
    }
    return GroupEvaluation(evaluations, identity_swaps(motions, truth) if len(motions) > 1 else ())


def summary_dict(summary: ErrorSummary) -> dict[str, Any]:
    """A summary for JSON, in millimetres."""
    return _in_mm(asdict(summary), "mean", "std", "median", "percentile_95", "maximum")


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a mapping as readable JSON, in one piece or not at all; NaN becomes null."""
    with atomic_path(Path(path)) as temporary:
        temporary.write_text(json.dumps(_without_nan(content), indent=2) + "\n")


_ROW = "{:<24}{:>8}{:>8}{:>8}{:>8}{:>8}{:>7}{:>7}"


def _summary_row(title: str, s: ErrorSummary) -> str:
    if s.num_values == 0:
        return _ROW.format(title, *"-------")
    lengths = [f"{MM * value:.1f}" for value in (s.mean, s.std, s.median, s.percentile_95, s.maximum)]
    return _ROW.format(title, *lengths, f"{s.under_50mm:.0%}", f"{s.under_100mm:.0%}")


def _points_dict(points: PointErrors | None) -> dict[str, Any] | None:
    if points is None:
        return None
    per_point = zip(
        points.names,
        points.compared_with,
        mean_per_point(points.errors),
        std_per_point(points.errors),
        strict=True,
    )
    return {
        **summary_dict(summarize(points.errors)),
        "per_point": {
            name: {"joint": joint, "mean_mm": MM * float(mean), "std_mm": MM * float(std)}
            for name, joint, mean, std in per_point
        },
        "mean_per_frame_mm": [MM * float(value) for value in mean_per_frame(points.errors)],
    }


def _in_mm(content: dict[str, Any], *keys: str) -> dict[str, Any]:
    return {f"{k}_mm" if k in keys else k: MM * v if k in keys else v for k, v in content.items()}


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
