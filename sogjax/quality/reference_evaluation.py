"""A motion held against that of another system: joint angles by joint and plane, joints in millimetres."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError, counted
from sogjax.io.export.angles import SEGMENT_JOINTS, has_angles, joint_angles, segment_angles
from sogjax.io.export.bones import bone_frames, bones_of, world_turn
from sogjax.io.files import write_json
from sogjax.io.motion import Motion
from sogjax.io.reference.names import point_named, segment_named
from sogjax.io.reference.reference_motion import ReferenceMotion
from sogjax.quality.angle_errors import AngleError, angle_errors, angle_table, angles_dict
from sogjax.quality.evaluation import TABLE_ROW, points_dict, summary_row
from sogjax.quality.markers import PointErrors
from sogjax.quality.metrics import summarize
from sogjax.quality.time_offset import LEAST_CORRELATION, time_offset

Columns = Mapping[str, Float[np.ndarray, "frame"]]
Points = Mapping[str, Float[np.ndarray, "frame 3"]]

_BETWEEN = {
    "hip": ("{}_shoulder", "{}_hip", "{}_knee"),
    "knee": ("{}_hip", "{}_knee", "{}_ankle"),
    "ankle": ("{}_knee", "{}_ankle", "{}_toe"),
    "shoulder": ("{}_hip", "{}_shoulder", "{}_elbow"),
    "elbow": ("{}_shoulder", "{}_elbow", "{}_wrist"),
}
"""Angles between the lines from a joint to two others, which files of points tell."""
_OTHER_WAY = -0.8
"""Correlation below which an angle is taken to be counted the other way."""


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
        InputError: no name or no time in common.
    """
    if not np.isfinite(motion.world_from_joint).all():
        raise InputError("the motion has values that are not finite; track it again")
    ours, names = our_points(motion), _matched(motion, reference)
    our_angles = joint_angles(motion, motion.up) if has_angles(motion) else {}
    common = [name for name in reference.angles if name in our_angles]
    segments = _segments(motion, reference)
    if not common and (reference.angles or not names):
        theirs = ", ".join([*reference.angles, *reference.points][:8])
        whose = f" of {motion.actor}" if motion.actor else ""
        raise InputError(
            f"{reference.path}: none of its names ({theirs}, ...) is a joint or angle of the motion{whose}; give one "
            "with names such as knee_angle_r or RKnee, or the motion of such a body"
        )
    _check_time(motion, reference, offset)
    notes = list(reference.notes)
    if offset is None:
        pairs = [(our_angles[name], reference.angles[name]) for name in common]
        pairs = pairs or _distances(ours, reference.points, names)
        offset, said = _found_offset(pairs, motion.time, reference.time)
        notes.append(said)
    at = lambda values: _at(reference, values, motion.time - offset)
    their_points = {our: at(reference.points[name]) for name, our in names.items()}
    their_angles = {name: at(reference.angles[name]) for name in common}
    rows = _known(their_points, their_angles)
    if rows.sum() < 2:
        raise _no_common_time(motion, reference, offset)
    if abs(reference.fps / _rate(motion) - 1.0) > 1e-3:
        rates = f"{reference.fps:.4g} frames per second were resampled to the motion's {_rate(motion):.4g}"
        notes.append(f"its {rates}")
    their_angles, turned_round = _same_way(our_angles, their_angles, rows)
    notes += turned_round
    turn, placed = _placed(ours, their_points, rows)
    ours_all, theirs_all = dict(our_angles), dict(their_angles)
    if segments and turn is not None:
        turns = {name: _nearest_turns(at(values)) for name, values in segments.items()}
        theirs_all |= _calibrated(motion, turns, turn, rows)
        notes.append("the axes of its bones were turned to ours where they fit best: angles lack that offset")
    elif not common:
        ours_all |= _between(ours)
        theirs_all |= _between(their_points)
    cut = lambda columns: {name: values[rows] for name, values in columns.items()}
    times = motion.time[rows]
    return ReferenceEvaluation(
        truth=reference.path,
        num_frames=int(rows.sum()),
        seconds=(float(times[0]), float(times[-1])),
        offset=offset,
        angles=angle_errors(cut(ours_all), cut(theirs_all)),
        joints=_distances_between(ours, their_points, rows),
        placed=placed,
        notes=(*notes, *_not_matched(reference, names, common, segments)),
    )


def our_points(motion: Motion) -> dict[str, Float[np.ndarray, "frame 3"]]:
    """Landmarks and origins of bones in a world with y up, by their names."""
    bones = bones_of(motion)
    _, positions = bone_frames(motion, bones, motion.up, "y")
    landmarks = [] if motion.landmark_names is None else map(str, motion.landmark_names)
    turn = world_turn(motion.up, "y").T
    return dict(zip(bones.names, positions.swapaxes(0, 1), strict=True)) | {
        name: motion.joint(name).astype(float) @ turn for name in landmarks
    }


def _matched(motion: Motion, reference: ReferenceMotion) -> dict[str, str]:
    """Our name of each of the other system's points that is a point of the motion, too."""
    ours = our_points(motion)
    found: dict[str, str] = {}
    for name in reference.points:
        if name in reference.turns and name in ours:  # a bone of our own files
            found[name] = name
        elif (known := point_named(name, bool(reference.turns))) in ours and known not in found.values():
            found[name] = known
    return found


def _segments(motion: Motion, reference: ReferenceMotion) -> dict[str, Float[np.ndarray, "_frame 3 3"]]:
    """World from bone of the other system's segments that the motion has, too."""
    if not has_angles(motion):
        return {}
    found = {segment_named(bone): turns for bone, turns in reference.turns.items()}
    return {segment: turns for segment, turns in found.items() if segment is not None}


def _check_time(motion: Motion, reference: ReferenceMotion, offset: float | None) -> None:
    first, last = reference.time[0] + (offset or 0.0), reference.time[-1] + (offset or 0.0)
    if last < motion.time[0] or first > motion.time[-1]:
        raise _no_common_time(motion, reference, offset or 0.0)


def _no_common_time(motion: Motion, reference: ReferenceMotion, offset: float) -> InputError:
    first, last = reference.time[0] + offset, reference.time[-1] + offset
    return InputError(
        f"{reference.path}: has no time in common with the motion, which lasts from {motion.time[0]:.2f} to "
        f"{motion.time[-1]:.2f} s (its own is {first:.2f} to {last:.2f} s); give offset=SECONDS to add to it"
    )


def _found_offset(
    pairs: list[tuple[np.ndarray, np.ndarray]], our_time: np.ndarray, their_time: np.ndarray
) -> tuple[float, str]:
    """The offset by cross-correlation, and what is said of it."""
    pairs = [pair for pair in pairs if all(np.isfinite(each).sum() > 2 for each in pair)]
    found, alike = (
        time_offset([a for a, _ in pairs], our_time, [b for _, b in pairs], their_time) if pairs else (0.0, 0.0)
    )
    if alike < LEAST_CORRELATION:
        return 0.0, f"no time offset was found (correlation {alike:.2f}): times were taken as they are; or give offset="
    return found, f"its times were shifted by {found:+.3f} s, found by cross-correlation ({alike:.3f})"


def _distances(
    ours: Points, theirs: Mapping[str, Float[np.ndarray, "_frame 3"]], names: Mapping[str, str]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Distances of pairs of points from each other, which do not depend on the world; ours and theirs.

    With one point it is its height.
    """
    if len(names) < 2:
        return [(ours[our][:, 1], theirs[name][:, 1]) for name, our in names.items()]
    first, *others = names
    apart = lambda points, one, other: np.linalg.norm(points[one] - points[other], axis=-1)
    chain = zip([first, *others], [*others, first], strict=True)
    skipped = zip([first, *others], [*others[1:], first, *others[:1]], strict=True)
    return [
        (apart(ours, names[one], names[other]), apart(theirs, one, other))
        for one, other in (*chain, *skipped)
        if one != other
    ]


def _at(reference: ReferenceMotion, values: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Values at other times, linearly between frames; NaN outside and where a neighbour is not known."""
    flat = values.reshape(len(values), -1)
    rounding = 1e-3 / reference.fps  # times in files have six digits
    inside = (time >= reference.time[0] - rounding) & (time <= reference.time[-1] + rounding)
    at = np.stack([np.where(inside, np.interp(time, reference.time, column), np.nan) for column in flat.T], axis=-1)
    return at.reshape(len(time), *values.shape[1:])


def _known(points: Points, angles: Columns) -> np.ndarray:
    known = [np.isfinite(values).all(axis=-1) for values in points.values()]
    return np.asarray(np.any(known + [np.isfinite(values) for values in angles.values()], axis=0))


def _rate(motion: Motion) -> float:
    """Frames per second of the frames that the motion has."""
    return 1.0 / float(np.median(np.diff(motion.time))) if motion.num_frames > 1 else motion.fps


def _same_way(ours: Columns, theirs: Columns, rows: np.ndarray) -> tuple[dict[str, np.ndarray], list[str]]:
    """Their angles, those that are counted the other way turned round, and what is said of these."""
    turned, said = dict(theirs), []
    for name, values in theirs.items():
        a, b = ours[name][rows], values[rows]
        known = np.isfinite(b)
        moves = known.sum() > 2 and min(np.ptp(a[known]), np.ptp(b[known])) > 1.0
        if moves and np.corrcoef(a[known], b[known])[0, 1] < _OTHER_WAY:
            turned[name] = -values
            said.append(f"{name} is counted the other way in the truth and was turned round")
    return turned, said


def _distances_between(ours: Points, theirs: Points, rows: np.ndarray) -> PointErrors | None:
    if not theirs:
        return None
    errors = [np.linalg.norm(ours[name][rows] - values[rows], axis=-1) for name, values in theirs.items()]
    return PointErrors(tuple(theirs), tuple(theirs), np.stack(errors, axis=1))


def _placed(
    ours: Points, theirs: Points, rows: np.ndarray
) -> tuple[Float[np.ndarray, "3 3"] | None, PointErrors | None]:
    """The rotation of their world that lays all points best on ours (Kabsch), and the distances that remain."""
    if len(theirs) < 3:
        return None, None
    a = np.stack([ours[name][rows] for name in theirs], axis=1)
    b = np.stack([values[rows] for values in theirs.values()], axis=1)
    known = np.isfinite(b).all(axis=-1)
    middle_a, middle_b = a[known].mean(axis=0), b[known].mean(axis=0)
    turn = _best_turn((b[known] - middle_b).T @ (a[known] - middle_a))
    placed = {name: (values - middle_b) @ turn.T + middle_a for name, values in theirs.items()}
    return turn, _distances_between(ours, placed, rows)


def _best_turn(products: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """The rotation R with the largest trace of R @ products."""
    u, _, vt = np.linalg.svd(products)
    return vt.T @ np.diag([1.0, 1.0, np.linalg.det(vt.T @ u.T)]) @ u.T


def _nearest_turns(matrices: Float[np.ndarray, "frame 3 3"]) -> Float[np.ndarray, "frame 3 3"]:
    """The rotations nearest to matrices between rotations; NaN stays."""
    known = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    u, _, vt = np.linalg.svd(np.where(known[:, None, None], matrices, np.eye(3)))
    signs = np.stack([np.ones(len(u)), np.ones(len(u)), np.linalg.det(u @ vt)], axis=-1)
    return np.where(known[:, None, None], (u * signs[:, None, :]) @ vt, np.nan)


def _calibrated(
    motion: Motion, theirs: Mapping[str, Float[np.ndarray, "frame 3 3"]], turn: np.ndarray, rows: np.ndarray
) -> dict[str, np.ndarray]:
    """Their joint angles, with each bone's own axes turned to ours where they fit best over all frames."""
    joints = motion.joint_names.tolist()
    to_y = world_turn(motion.up, "y")
    whole, known = {}, rows
    for segment, turns in theirs.items():
        if SEGMENT_JOINTS[segment] not in joints:
            continue
        ours = to_y @ motion.world_from_joint[:, joints.index(SEGMENT_JOINTS[segment]), :3, :3].astype(float) @ to_y.T
        placed = turn @ turns
        here: np.ndarray = rows & np.isfinite(turns).all(axis=(1, 2))
        if here.any():
            axes = _best_turn(np.einsum("tji,tjk->ik", ours[here], placed[here]))
            whole[segment] = np.where(here[:, None, None], placed, np.eye(3)) @ axes
            known = known & here
    return {name: np.where(known, values, np.nan) for name, values in segment_angles(whole, "y").items()}


def _between(points: Points) -> dict[str, np.ndarray]:
    """Angles in degrees between the lines from a joint to two others, for the joints that are known."""
    angles = {}
    for side in ("left", "right"):
        for joint, three in _BETWEEN.items():
            names = [each.format(side) for each in three]
            if all(name in points for name in names):
                above, at, below = (points[name] for name in names)
                one, other = above - at, below - at
                aside = np.linalg.norm(np.cross(one, other), axis=-1)
                angles[f"{joint}_{side[0]}"] = np.degrees(np.arctan2(aside, (one * other).sum(axis=-1)))
    return angles


def _not_matched(
    reference: ReferenceMotion, names: Mapping[str, str], angles: list[str], segments: Mapping[str, np.ndarray]
) -> list[str]:
    """What of the other system's was not compared, in a line."""
    points = [name for name in reference.points if name not in names and segment_named(name) not in segments]
    rest = [*points, *(name for name in reference.angles if name not in angles)]
    return [f"not matched, and not compared: {', '.join(rest)}"] if rest else []
