"""A motion held against that of another system: joint angles by joint and plane, joints in millimetres."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sogjax.errors import InputError, counted
from sogjax.io.export.angles import has_angles, joint_angles
from sogjax.io.files import write_json
from sogjax.io.motion import Motion
from sogjax.io.reference.reference_motion import ReferenceMotion
from sogjax.quality.angle_errors import AngleError, angle_errors, angle_table, angles_dict
from sogjax.quality.evaluation import TABLE_ROW, points_dict, summary_row
from sogjax.quality.line_angles import angles_between
from sogjax.quality.markers import PointErrors
from sogjax.quality.metrics import summarize
from sogjax.quality.reference.angles import same_way
from sogjax.quality.reference.names import common_names, our_points
from sogjax.quality.reference.places import calibrated_angles, placed_errors, point_errors
from sogjax.quality.reference.times import at_times, check_time, common_rows, distances, found_offset, resampled


@dataclass(frozen=True)
class ReferenceEvaluation:
    """How far a motion is from another system's, over the time that both have."""

    truth: Path
    num_frames: int
    seconds: tuple[float, float]
    """First and last time that was compared, by the motion's clock."""
    offset: float
    """Seconds that were added to the other system's times."""
    angles: tuple[AngleError, ...]
    joints: PointErrors | None
    """With the worlds as they are."""
    placed: PointErrors | None
    """With the other system's world placed so that the joints lie best on ours; None with fewer than three points."""
    notes: tuple[str, ...]
    """What was found, assumed or not matched."""

    def as_dict(self) -> dict[str, Any]:
        """What `to_json` writes."""
        return {
            "truth": str(self.truth),
            "num_frames": self.num_frames,
            "seconds": list(self.seconds),
            "offset_s": self.offset,
            "angles": angles_dict(self.angles) if self.angles else None,
            "joints": points_dict(self.joints),
            "joints_placed": points_dict(self.placed),
            "notes": list(self.notes),
        }

    def to_json(self, path: Path) -> None:
        """Write the numbers as JSON."""
        write_json(path, self.as_dict())

    def table(self) -> str:
        """The numbers as plain text."""
        lines = angle_table(self.angles)
        if self.joints is not None:
            lines.append(TABLE_ROW.format("joints", "mean", "std", "median", "95 %", "max", "<50", "<100"))
            lines.append(summary_row("all, worlds as they are", summarize(self.joints.errors)))
            if self.placed is not None:
                lines.append(summary_row("all, worlds placed", summarize(self.placed.errors)))
            shown = self.placed or self.joints
            lines += [summary_row(f"  {name}", summarize(shown.errors[:, [k]])) for k, name in enumerate(shown.names)]
            lines.append("distances in mm")
        first, last = self.seconds
        lines.append(f"{counted(self.num_frames, 'frame')}, {first:.2f} to {last:.2f} s")
        return "\n".join([*lines, *self.notes])


def evaluate_against_reference(
    motion: Motion, reference: ReferenceMotion, offset: float | None = None
) -> ReferenceEvaluation:
    """Compare a motion with another system's.

    Args:
        motion: the tracked motion.
        reference: what the other system measured.
        offset: seconds to add to the other system's times; None: found by cross-correlation.

    Raises:
        InputError: no name or no time in common, or a motion that is not finite.
    """
    if not np.isfinite(motion.world_from_joint).all():
        raise InputError("the motion has values that are not finite; track it again")
    ours = our_points(motion)
    our_angles = joint_angles(motion, motion.up) if has_angles(motion) else {}
    common = common_names(motion, reference, ours, our_angles)
    check_time(motion, reference, offset or 0.0)
    notes = list(reference.notes)
    if offset is None:
        pairs = [(our_angles[name], reference.angles[name]) for name in common.angles]
        pairs = pairs or distances(ours, reference.points, common.points)
        offset, said = found_offset(pairs, motion.time, reference.time)
        notes.append(said)
    time = motion.time - offset
    their_points = {our: at_times(reference, reference.points[name], time) for name, our in common.points.items()}
    their_angles = {name: at_times(reference, reference.angles[name], time) for name in common.angles}
    segments = {name: at_times(reference, reference.turns[bone], time) for name, bone in common.segments.items()}
    rows = common_rows(motion, reference, offset, [*their_points.values(), *their_angles.values()])
    notes += resampled(motion, reference)
    their_angles, said_of_ways = same_way(our_angles, their_angles, rows)
    turn, placed = placed_errors(ours, their_points, rows)
    if segments and turn is not None:
        their_angles |= calibrated_angles(motion, segments, turn, rows)
        notes.append("the axes of its bones were turned to ours where they fit best: angles lack that offset")
    elif not common.angles:
        our_angles, their_angles = angles_between(ours), angles_between(their_points)
    cut = lambda columns: {name: values[rows] for name, values in columns.items()}
    times = motion.time[rows]
    return ReferenceEvaluation(
        truth=reference.path,
        num_frames=int(rows.sum()),
        seconds=(float(times[0]), float(times[-1])),
        offset=offset,
        angles=angle_errors(cut(our_angles), cut(their_angles)),
        joints=point_errors(ours, their_points, rows),
        placed=placed,
        notes=(*notes, *said_of_ways, *common.not_matched(reference)),
    )
