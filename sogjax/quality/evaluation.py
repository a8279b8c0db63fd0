"""One motion, or several, held against a ground truth: as data, as JSON and as a table."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from sogjax.errors import InputError, counted
from sogjax.io.files import write_json
from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import Motion
from sogjax.quality.angle_errors import AngleError, angle_table, angles_dict
from sogjax.quality.limb_warnings import DoubtfulLimb, doubtful_limbs
from sogjax.quality.markers import MARKER_RULES, MarkerRule, PointErrors, common_frames, joint_errors, marker_errors
from sogjax.quality.metrics import (
    ErrorSummary,
    LostPoint,
    lost_points,
    mean_per_frame,
    mean_per_point,
    std_per_point,
    summarize,
)
from sogjax.quality.swaps import Swap, identity_swaps
from sogjax.quality.true_angles import errors_of_angles

MM = 1000.0
TABLE_ROW = "{:<24}{:>8}{:>8}{:>8}{:>8}{:>8}{:>7}{:>7}"


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
    rule: MarkerRule = "scaled"
    """How `markers` were attached."""
    markers_by_rule: Mapping[str, PointErrors] = field(default_factory=dict)
    """The markers attached by either rule; empty where the truth has none."""
    doubtful: tuple[DoubtfulLimb, ...] = ()
    """What tracking itself doubted, without knowing the truth."""
    angles: tuple[AngleError, ...] = ()
    """Joint angles, where the truth has them and the motion those joints."""

    def __str__(self) -> str:
        return self.table(details=False)

    @property
    def summary(self) -> ErrorSummary:
        """The numbers of the markers, or of the joints where the truth has no markers."""
        points = self.markers or self.joints
        return summarize(points.errors if points else np.zeros((len(self.frames), 0)))

    @property
    def num_labelled(self) -> int:
        """In how many of the frames the truth knows a point."""
        known = [np.isfinite(points.errors).any(axis=1) for points in (self.markers, self.joints) if points is not None]
        return int(np.any(known, axis=0).sum())

    def as_dict(self) -> dict[str, Any]:
        """What `to_json` writes: millimetres, None where nothing was compared."""
        return {
            "name": self.name,
            "num_frames": len(self.frames),
            "first_frame": int(self.frames[0]),
            "last_frame": int(self.frames[-1]),
            "num_labelled_frames": self.num_labelled,
            "marker_rule": self.rule,
            "markers": points_dict(self.markers),
            "markers_by_rule": {rule: rule_dict([points]) for rule, points in self.markers_by_rule.items()},
            "joints": points_dict(self.joints),
            "angles": angles_dict(self.angles) if self.angles else None,
            "lost": [in_mm(asdict(point), "mean") for point in self.lost],
            "doubtful": [asdict(limb) for limb in self.doubtful],
        }

    def to_json(self, path: Path) -> None:
        """Write the numbers, per marker and per frame too, as JSON."""
        write_json(path, self.as_dict())

    def table(self, details: bool = True) -> str:
        """The numbers in millimetres as a plain-text table, with every marker and joint unless told otherwise."""
        lines = [TABLE_ROW.format(self.name or "mm", "mean", "std", "median", "95 %", "max", "<50", "<100")]
        for title, points in (("markers", self.markers), ("joints", self.joints)):
            if points is not None:
                lines.append(summary_row(f"all {title}", summarize(points.errors)))
                rows = enumerate(points.names) if details else ()
                lines += [summary_row(f"  {name}", summarize(points.errors[:, [k]])) for k, name in rows]
        labelled = "" if self.num_labelled == len(self.frames) else f", of which {self.num_labelled} are labelled"
        frames = f"{counted(len(self.frames), 'frame')}, {self.frames[0]} to {self.frames[-1]}{labelled}"
        lines.append(f"{frames}; distances in mm")
        if self.markers is not None:
            lines += self._about_markers()
        lines += [
            f"lost: {p.name} in frames {p.first_frame} to {p.last_frame}, {MM * p.mean:.0f} mm" for p in self.lost
        ]
        lines += angle_table(self.angles) if details else []
        return "\n".join(lines)

    def _about_markers(self) -> list[str]:
        both = ", ".join(
            f"{rule} {MM * (s := summarize(points.errors)).mean:.1f} +- {MM * s.std:.1f}"
            for rule, points in self.markers_by_rule.items()
        )
        return [
            f"markers by the rule {self.rule}; by either, mean +- std: {both}",
            "markers are attached in their first frame, which counts: a wrong initial pose shows in the joints only",
        ]


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
            "marker_rule": next((e.rule for e in self.evaluations.values()), None),
            "all": summary_dict(self.summary),
            "markers_by_rule": {rule: rule_dict(parts) for rule, parts in self._markers_by_rule().items()},
            "subjects": {name: e.as_dict() for name, e in self.evaluations.items()},
            "swaps": [asdict(swap) for swap in self.swaps],
        }

    def _markers_by_rule(self) -> dict[str, list[PointErrors]]:
        rules = dict.fromkeys(rule for e in self.evaluations.values() for rule in e.markers_by_rule)
        each = self.evaluations.values()
        return {rule: [e.markers_by_rule[rule] for e in each if rule in e.markers_by_rule] for rule in rules}

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
    motion: Motion,
    truth: GroundTruth,
    name: str = "",
    rule: MarkerRule = "scaled",
) -> Evaluation:
    """Compare one motion with the truth of its subject (names without a prefix).

    Args:
        motion: the tracked motion.
        truth: what it should be; see `GroundTruth.subject` where there are several subjects.
        name: title of the result.
        rule: how markers are attached; the result gives the mean by the other rule as well.

    Raises:
        InputError: nothing can be compared.
    """
    rows, truth_rows = common_frames(motion, truth)
    frames = np.asarray(motion.frame, int)[rows]
    by_rule = {each: found for each in MARKER_RULES if (found := marker_errors(motion, truth, each)) is not None}
    markers = by_rule.get(rule)
    joints = joint_errors(motion, truth)
    if markers is None and joints is None:
        raise InputError(
            f"none of the truth's joints ({', '.join(map(str, truth.joint_names))}) is a joint of the "
            "motion; name the truth's after these"
        )
    points = markers or joints
    lost = lost_points(points.errors, points.names, frames) if points else ()
    return Evaluation(
        name,
        frames,
        markers,
        joints,
        lost,
        rule,
        by_rule,
        doubtful_limbs(motion),
        errors_of_angles(motion, rows, truth, truth_rows),
    )


def evaluate_motions(
    motions: Mapping[str, Motion],
    truth: GroundTruth,
    rule: MarkerRule = "scaled",
) -> GroupEvaluation:
    """Compare actors' motions, by name, with a truth whose names have the prefixes `NAME/`.

    A truth without prefixes is that of the only actor.

    Raises:
        InputError: an actor that the truth does not have; several actors, but a truth of one; a truth that knows no
            point in the motions' frames.
    """
    alone = len(motions) == 1 and not truth.subjects
    evaluations = {
        name: evaluate_motion(motion, truth if alone else truth.subject(name), name, rule)
        for name, motion in motions.items()
    }
    if not any(evaluation.num_labelled for evaluation in evaluations.values()):
        frames = next(iter(evaluations.values())).frames
        raise InputError(
            f"the truth knows no point in the motion's frames {frames[0]} to {frames[-1]}; compare labelled frames"
        )
    return GroupEvaluation(evaluations, identity_swaps(motions, truth) if len(motions) > 1 else ())


def summary_dict(summary: ErrorSummary) -> dict[str, Any]:
    """A summary for JSON, in millimetres."""
    return in_mm(asdict(summary), "mean", "std", "median", "percentile_95", "maximum")


def rule_dict(parts: Sequence[PointErrors]) -> dict[str, float]:
    """Mean and deviation of all markers of some actors, for JSON."""
    summary = summarize(np.concatenate([part.errors.reshape(-1, 1) for part in parts]))
    return {"mean_mm": MM * summary.mean, "std_mm": MM * summary.std}


def summary_row(title: str, s: ErrorSummary) -> str:
    """One line of the table."""
    if s.num_values == 0:
        return TABLE_ROW.format(title, *"-------")
    lengths = [f"{MM * value:.1f}" for value in (s.mean, s.std, s.median, s.percentile_95, s.maximum)]
    return TABLE_ROW.format(title, *lengths, f"{s.under_50mm:.0%}", f"{s.under_100mm:.0%}")


def points_dict(points: PointErrors | None) -> dict[str, Any] | None:
    """Points for JSON: all together, each one, each frame."""
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


def in_mm(content: dict[str, Any], *keys: str) -> dict[str, Any]:
    """A mapping with some lengths in millimetres, which their keys then say."""
    return {f"{k}_mm" if k in keys else k: MM * v if k in keys else v for k, v in content.items()}
