"""Skeletool's `.skeleton` V1.0, `.dof` v0.3 and `.motion` V1.0: millimetres and radians."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError, counted
from sogjax.io.actor_rows import WORLD
from sogjax.io.files import atomic_path
from sogjax.io.motion import Motion, motion_from_poses
from sogjax.io.motion_data import DEFAULT_UP
from sogjax.io.skeletons.rows import GREY, MAX_ROWS, Row, SkeletonRows, attach_blobs
from sogjax.io.text_lines import Lines
from sogjax.model.body import Body

HEADER, MOTION_HEADER = "Skeletool Skeleton Definition V1.0", "Skeletool Motion File V1.0"
MAX_BYTES = 4 * 2**20
"""A larger file is no skeleton."""

_JOINT = "a joint: name revolute|prismatic parent offset (3) axis (3) scale"
_MARKER = "a marker: name parent point offset (3) [size [r g b]]"
_DOF = "a degree of freedom: name and number of its joints"
_LIMITS = "`limits LOW HIGH` or `nolimits`"


def read_skeletool_skeleton(path: Path, dof: Path | None = None) -> SkeletonRows:
    """The skeleton of a `.skeleton`, its degrees of freedom replaced by those of a `.dof`, where one is given.

    Markers with a size become blobs, those without landmarks. Where no marker has a size, blobs are put along the
    bones.
    """
    lines = _after_header(path, HEADER, MAX_BYTES)
    rows = SkeletonRows(path.stem)
    sections = {"joints:": _joints, "markers:": _markers, "scaling": _scaling, "dofs:": _dofs}
    while lines.left:
        words = lines.take("a section")
        section = sections.pop(words[0], None)
        if section is None or len(words) != (3 if words[0] == "scaling" else 2):
            raise lines.error(f"one of {' '.join(sections)} with a number, each once")
        section(lines, rows, lines.count(words[-1], MAX_ROWS))
    if dof is not None:
        rows.dofs = _read_dof(dof)
    if not rows.landmarks:
        rows.landmarks = [{"name": row["name"], "joint": row["name"], "offset": [0.0] * 3} for row in rows.joints]
    if not rows.blobs:
        attach_blobs(rows)
    return rows


def _after_header(path: Path, header: str, max_bytes: int) -> Lines:
    """The lines of a file that begins with a header, behind it."""
    lines = Lines(path, max_bytes)
    if " ".join(lines.take("the header")) != header:
        raise lines.error(f"the header {header!r}")
    return lines


def _read_dof(path: Path) -> list[Row]:
    """The degrees of freedom of a `.dof`; their smoothness has no counterpart here."""
    lines = Lines(path, MAX_BYTES)
    words = lines.take("`dofs: N`")
    if words[0] != "dofs:":
        words = lines.take("`dofs: N`")
    if words[0] != "dofs:" or len(words) != 2:
        raise lines.error("`dofs: N`")
    dofs: dict[str, Row] = {}
    for _ in range(lines.count(words[1], MAX_ROWS)):
        name, _, *limits = lines.take(f"name smoothness {_LIMITS}", (3, 5))
        if name in dofs:
            raise lines.error("a name that no degree of freedom before it has")
        dofs[name] = {"name": name, "limits": _limits(lines, limits), "joints": {}}
    words = lines.take("`joints: N`", (2,))
    if words[0] != "joints:":
        raise lines.error("`joints: N`")
    for _ in range(lines.count(words[1], MAX_ROWS)):
        _add_weights(lines, dofs)
    return [*dofs.values()]


def _add_weights(lines: Lines, dofs: dict[str, Row]) -> None:
    expected = "joint = 0 + weight dof + weight dof ..."
    joint, *words = lines.take(expected)
    if len(words) < 2 or words[0] != "=" or len(words) % 3 != 2:
        raise lines.error(expected)
    if lines.number(words[1]) != 0.0:
        raise lines.error(f"{expected}: a joint that is 0 where its degrees of freedom are")
    for plus, weight, dof in zip(words[2::3], words[3::3], words[4::3], strict=True):
        if plus != "+" or dof not in dofs:
            raise lines.error(f"{expected}, with degrees of freedom that are listed above")
        if lines.number(weight):
            dofs[dof]["joints"][joint] = dofs[dof]["joints"].get(joint, 0.0) + lines.number(weight)


def _joints(lines: Lines, rows: SkeletonRows, count: int) -> None:
    for _ in range(count):
        name, kind, parent, *words = lines.take(_JOINT, (10,))
        numbers = lines.numbers(words, _JOINT)
        offset = [numbers[6] * value for value in numbers[:3]]
        rows.add_joint(name, WORLD if parent == "none" else parent, offset, numbers[3:6], kind)


def _markers(lines: Lines, rows: SkeletonRows, count: int) -> None:
    for _ in range(count):
        name, parent, kind, *words = lines.take(_MARKER, (6, 7, 10))
        numbers = lines.numbers(words, _MARKER)
        if kind != "point":
            raise lines.error(_MARKER)
        place = {"name": name, "joint": parent, "offset": numbers[:3]}
        if len(numbers) == 3:
            rows.landmarks.append(place)
        else:
            color = numbers[4:] or GREY
            color = [value / 255.0 for value in color] if max(color) > 1.0 else color
            sigma = (1.0 / 1.35) * numbers[3]  # fits a disc of that radius best
            rows.blobs.append(place | {"sigma": sigma, "color": color})


def _scaling(lines: Lines, rows: SkeletonRows, count: int) -> None:
    for _ in range(count):
        name, number = lines.take("a group: name and number of its joints", (2,))
        joints = [lines.take("the name of a joint", (1,))[0] for _ in range(lines.count(number, MAX_ROWS))]
        rows.add_to_group(name, joint_offsets=joints)


def _dofs(lines: Lines, rows: SkeletonRows, count: int) -> None:
    for _ in range(count):
        name, number = lines.take(_DOF, (2,))
        joints = lines.count(number, MAX_ROWS)
        limits = _limits(lines, lines.take(_LIMITS, (1, 3)))
        weights: dict[str, float] = {}
        for _ in range(joints):
            joint, weight = lines.take("a joint and its weight", (2,))
            if lines.number(weight):
                weights[joint] = lines.number(weight)
        rows.dofs.append({"name": name, "limits": limits, "joints": weights})


def _limits(lines: Lines, words: list[str]) -> list[float] | str:
    if words == ["nolimits"]:
        return "none"
    if len(words) != 3 or words[0] != "limits":
        raise lines.error(_LIMITS)
    return lines.numbers(words[1:], _LIMITS)


def read_skeletool_motion(path: Path, body: Body, fps: float, up: str = DEFAULT_UP) -> Motion:
    """The motion of `body`, which stands upright in a world with the vertical `up`; the file has no frame rate.

    Raises:
        InputError: no such file, or a line that is not a frame and a value for every degree of freedom.
    """
    lines = _after_header(path, MOTION_HEADER, 256 * 2**20)
    count = body.skeleton.num_dofs
    expected = f"a frame and {counted(count, 'number')}, one for each degree of freedom of {body.name!r}"
    frames: list[int] = []
    poses: list[list[float]] = []
    while lines.left:
        words = lines.take(expected, (1 + count,))
        frame = lines.number(words[0], expected)
        if frame != round(frame) or (frames and frame <= frames[-1]):
            raise lines.error(f"{expected}; frames are whole numbers that increase")
        frames.append(int(frame))
        poses.append(lines.numbers(words[1:], expected))
    values = np.array(poses, float).reshape(-1, count) / _file_units(body)
    return motion_from_poses(body, values, fps, frame=np.array(frames, int), up=up)


def write_skeletool_motion(path: Path, motion: Motion, body: Body) -> None:
    """Write the poses of a motion of `body`.

    Raises:
        InputError: the motion is not one of this body.
    """
    if tuple(motion.dof_names.tolist()) != body.skeleton.dof_names:
        raise InputError(
            f"{path}: the motion's degrees of freedom are not those of the body {body.name!r}; "
            "give the actor that was tracked as actor=..."
        )
    values = motion.pose.astype(float) * _file_units(body)
    rows = (
        f"{frame} {' '.join(f'{value:.9g}' for value in row)}\n"
        for frame, row in zip(motion.frame.tolist(), values.tolist(), strict=True)
    )
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"{MOTION_HEADER}\n")
        file.writelines(rows)


def _file_units(body: Body) -> Float[np.ndarray, "dof"]:
    """What a metre or radian is in the file: degrees of freedom that only slide joints are lengths."""
    moves = np.asarray(body.skeleton.parameter_transform) != 0.0
    turns = (moves & np.asarray(body.skeleton.revolute)[:, None]).any(axis=0)
    return np.where(turns, 1.0, 1000.0)
