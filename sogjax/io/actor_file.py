"""Body files: a body, or the actor fitted to one subject, as YAML that a person can read and edit."""

from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import yaml
from jaxtyping import Float
from numpy.typing import ArrayLike

from sogjax.errors import InputError
from sogjax.io import actor_rows
from sogjax.io.actor_rows import WORLD, Row, filled_table, names, table
from sogjax.io.calibration.rig import METRES_PER_UNIT
from sogjax.io.files import write_file
from sogjax.io.yaml_entry import Entry, read_yaml
from sogjax.model.body import Attachments, Body
from sogjax.model.color import COLOR_RADIUS, to_rgb
from sogjax.model.rotation import UP_AXES, axis_vector
from sogjax.model.skeleton import Skeleton

ADULT = "human"
"""The body that comes with the package and has an adult's size."""
_SHAPE_FIELDS = ("joint_offsets", "blob_offsets", "blob_sigmas", "landmark_offsets")
"""The lists of names in a row of `shape`."""


def named_body(name: str) -> Path:
    """The file of a body that comes with the package.

    Raises:
        InputError: there is no such body.
    """
    shipped = _bundled()
    if name not in shipped:
        raise InputError(f"{name}: there is no such file, and no such body comes with sogjax: {', '.join(shipped)}")
    return shipped[name]


def _bundled() -> dict[str, Path]:
    return {path.stem: path for path in sorted((Path(__file__).parent / "bodies").glob("*.yaml"))}


def bundled_like(body: Body) -> Body | None:
    """The body that comes with the package and has the same joints."""
    joints = lambda one: (one.skeleton.names, one.skeleton.parents)
    found = map(_bundled_body, sorted(_bundled(), key=lambda name: name != ADULT))
    return next((one for one in found if joints(one) == joints(body)), None)


@cache
def _bundled_body(name: str) -> Body:
    return load_body(_bundled()[name])


def load_body(path: Path) -> Body:
    """The body of a file; lengths become metres, colours sRGB.

    Joints may stand in any order in the file; in the body, parents come before their children.

    Raises:
        InputError: the file is no such body; the message names the key, its value and what was expected.
    """
    return body_from(read_yaml(Path(path)))


def body_from(content: Entry, metres: float | None = None) -> Body:
    """The body that the content of a body file describes; `metres` is its unit of length, where it names none."""
    document = content.fields(
        ("name", "joints", "dofs", "blobs", "poses"), ("unit", "color_space", "landmarks", "shape", "explained")
    )
    name = document["name"].file_name()
    metres = metres or 1.0
    if "unit" in document:
        metres = METRES_PER_UNIT[document["unit"].choice(METRES_PER_UNIT, "a unit of length")]
    space = document["color_space"].choice(COLOR_RADIUS, "a colour space") if "color_space" in document else "rgb"
    joint_rows = actor_rows.sorted_by_parent(
        filled_table(document["joints"], ("name", "parent", "offset", "axis", "kind"))
    )
    dof_rows = filled_table(document["dofs"], ("name", "joints"), ("limits",))
    blob_rows = filled_table(document["blobs"], ("name", "joint", "offset", "sigma"), ("color", "colour"))
    landmark_rows = table(document["landmarks"], ("name", "joint", "offset")) if "landmarks" in document else []
    shape_rows = table(document["shape"], ("name",), _SHAPE_FIELDS) if "shape" in document else []

    skeleton, dof_metres = _skeleton(joint_rows, dof_rows, metres)
    colors = [
        actor_rows.color(row, place, space) for row, place in zip(blob_rows, document["blobs"].items(), strict=True)
    ]
    explained = document["explained"].number("a part of 1", 0.0, 1.0) if "explained" in document else 0.0
    known = (skeleton.names, names(blob_rows), names(blob_rows), names(landmark_rows))
    return Body(
        name=name,
        skeleton=skeleton,
        blobs=_attachments(blob_rows, skeleton.names, metres),
        blob_sigmas=jnp.asarray(np.array([actor_rows.sigma(row["sigma"], metres) for row in blob_rows])),
        blob_colors=to_rgb(jnp.asarray(np.array(colors)), space),
        landmarks=_attachments(landmark_rows, skeleton.names, metres),
        poses={
            pose: jnp.asarray(actor_rows.pose(values, skeleton.dof_names) * dof_metres)
            for pose, values in document["poses"].fields_at_least(("rest",)).items()
        },
        shape_groups=tuple(
            actor_rows.shape_group(row, dict(zip(_SHAPE_FIELDS, known, strict=True))) for row in shape_rows
        ),
        explained=jnp.asarray(explained, jnp.float32),
    )


def save_body(path: Path, body: Body) -> None:
    """Write a body, in metres and sRGB, such that `load_body` gives the same body.

    Raises:
        InputError: the file cannot be written.
        ValueError: the body holds a number that is not finite.
    """
    text = "\n".join(_lines(body)) + "\n"
    write_file(path, text)


def _skeleton(joint_rows: list[Row], dof_rows: list[Row], metres: float) -> tuple[Skeleton, Float[np.ndarray, "dof"]]:
    """The skeleton, and the factors that turn the file's values of degrees of freedom into metres or radians.

    A DoF that only slides joints is a length; one that also turns joints is an angle, and its weight of a
    sliding joint is a length per radian.
    """
    index = {name: k for k, name in enumerate(names(joint_rows))}
    kinds = [row["kind"].choice(("revolute", "prismatic"), "a kind of joint") for row in joint_rows]
    revolute = np.array([kind == "revolute" for kind in kinds])
    transform = np.zeros((len(joint_rows), len(dof_rows)))
    for dof, row in enumerate(dof_rows):
        for joint, weight in actor_rows.weights(row["joints"], index).items():
            transform[index[joint], dof] = weight
    is_length = ~((transform != 0.0) & revolute[:, None]).any(axis=0)
    dof_metres = np.where(is_length, metres, 1.0)
    limits = np.array([actor_rows.limits(row.get("limits")) for row in dof_rows]) * dof_metres[:, None]
    parents = [actor_rows.parent_name(row["parent"]) for row in joint_rows]
    skeleton = Skeleton(
        names=tuple(index),
        parents=tuple(-1 if parent is None else index[parent] for parent in parents),
        dof_names=names(dof_rows),
        offsets=jnp.asarray(metres * np.array([row["offset"].numbers() for row in joint_rows])),
        axes=jnp.asarray(np.array([actor_rows.axis(row["axis"]) for row in joint_rows])),
        revolute=jnp.asarray(revolute),
        parameter_transform=jnp.asarray(transform * np.where(revolute[:, None] | is_length[None, :], 1.0, metres)),
        dof_lower=jnp.asarray(limits[:, 0]),
        dof_upper=jnp.asarray(limits[:, 1]),
    )
    return skeleton, dof_metres


def _attachments(rows: list[Row], joints: Sequence[str], metres: float) -> Attachments:
    offsets = np.array([row["offset"].numbers() for row in rows]).reshape(-1, 3)
    return Attachments(
        names=names(rows),
        joints=tuple(joints.index(row["joint"].choice(joints, "the name of a joint")) for row in rows),
        offsets=jnp.asarray(metres * offsets),
    )


def _lines(body: Body) -> Iterator[str]:
    skeleton = body.skeleton
    yield from (f"name: {_flow(body.name)}", "unit: m", "color_space: rgb")
    if (explained := float(body.explained)) > 0.0:
        yield f"explained: {explained:.3f}  # of it in its example poses; what is tracked with it is held against this"
    yield from ("", "joints:")
    offsets, axes, revolute = map(np.asarray, (skeleton.offsets, skeleton.axes, skeleton.revolute))
    for k, name in enumerate(skeleton.names):
        parent = skeleton.parents[k]
        yield _row(
            name=name,
            parent=WORLD if parent < 0 else skeleton.names[parent],
            offset=_numbers(offsets[k]),
            axis=_axis(axes[k]),
            kind="revolute" if revolute[k] else "prismatic",
        )
    yield from ("", "dofs:")
    weights = np.asarray(skeleton.parameter_transform)
    bounds = np.asarray(skeleton.dof_lower), np.asarray(skeleton.dof_upper)
    for k, name in enumerate(skeleton.dof_names):
        moved = {skeleton.names[j]: _number(weights[j, k]) for j in np.flatnonzero(weights[:, k])}
        limits = [_number(bound[k]) if np.isfinite(bound[k]) else None for bound in bounds]
        yield _row(name=name, limits="none" if limits == [None, None] else limits, joints=moved)
    yield from ("", "blobs:")
    sigmas, colors = np.asarray(body.blob_sigmas), np.round(np.asarray(body.blob_colors), 4)
    for row, size, rgb in zip(_points(body.blobs, skeleton.names), sigmas, colors, strict=True):
        yield _row(**row, sigma=_number(size), color=_numbers(rgb))
    yield from ("", "landmarks:" if body.landmarks.names else "landmarks: []")
    yield from (_row(**row) for row in _points(body.landmarks, skeleton.names))
    yield from ("", "shape:" if body.shape_groups else "shape: []")
    for group in body.shape_groups:
        yield f"  - name: {_flow(group.name)}"
        scaled = {field: [*getattr(group, field)] for field in _SHAPE_FIELDS}
        yield from (f"    {field}: {_flow(members)}" for field, members in scaled.items() if members)
    yield from ("", "poses:")
    for name, pose in body.poses.items():
        moved = {d: _number(v) for d, v in zip(skeleton.dof_names, np.asarray(pose), strict=True) if v != 0.0}
        yield f"  {_flow(name)}:" if moved else f"  {_flow(name)}: {{}}"
        yield from (f"    {_flow(dof)}: {_flow(value)}" for dof, value in moved.items())


def _points(points: Attachments, joints: Sequence[str]) -> Iterator[dict[str, object]]:
    for name, joint, offset in zip(points.names, points.joints, np.asarray(points.offsets), strict=True):
        yield {"name": name, "joint": joints[joint], "offset": _numbers(offset)}


def _axis(axis: Float[np.ndarray, "3"]) -> str | list[int | float]:
    letters = [letter for letter in UP_AXES if np.array_equal(axis, axis_vector(letter))]
    return letters[0] if letters else _numbers(axis)


def _numbers(values: ArrayLike) -> list[int | float]:
    return [_number(value) for value in np.asarray(values)]


def _number(value: np.floating) -> int | float:
    """The number with the fewest digits that gives this value in its own precision."""
    if not np.isfinite(value):
        raise ValueError(f"a body with the number {value} cannot be written")
    number = float(np.format_float_positional(value))
    return int(number) if number == int(number) else number


def _row(**fields: object) -> str:
    return f"  - {_flow(fields)}"


def _flow(value: object) -> str:
    text = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=float("inf"), allow_unicode=True)
    return text.removesuffix("...\n").strip()
