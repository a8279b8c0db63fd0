"""The rows of a body file, checked: what is wrong is named with its key, its value and what was expected."""

from collections.abc import Collection, Sequence

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.yaml_entry import Entry
from sogjax.model.body import ShapeGroup
from sogjax.model.rotation import UP_AXES, axis_vector

Row = dict[str, Entry]

WORLD = "world"
"""The parent of a root joint."""

MAX_ROWS = 2000
"""The rows that a table may have: the transform of as many joints and degrees of freedom takes 32 MB."""


def table(entry: Entry, required: Sequence[str], optional: Sequence[str] = ()) -> list[Row]:
    """The rows of a table; their names are unique and without the slash that `concatenate` puts in."""
    items = entry.items()
    if len(items) > MAX_ROWS:
        raise InputError(f"{entry.path}: {entry.key} has {len(items)} rows, more than {MAX_ROWS}; leave some out")
    rows = [item.fields(required, optional) for item in items]
    seen: set[str] = set()
    for row in rows:
        name = row["name"].file_name()
        if name in seen:
            raise row["name"].error("a name that no row before it has")
        seen.add(name)
    return rows


def filled_table(entry: Entry, required: Sequence[str], optional: Sequence[str] = ()) -> list[Row]:
    """A table with at least one row."""
    rows = table(entry, required, optional)
    if not rows:
        raise entry.error("at least one row")
    return rows


def names(rows: list[Row]) -> tuple[str, ...]:
    """The names of a table's rows."""
    return tuple(row["name"].text() for row in rows)


def parent_name(entry: Entry) -> str | None:
    """The name of the parent joint; None: it is a root."""
    return None if entry.value in (None, WORLD, "none") else entry.text()


def sorted_by_parent(rows: list[Row]) -> list[Row]:
    """The joints with parents before children, else in the order of the file."""
    by_name = {row["name"].text(): row for row in rows}
    ordered: dict[str, Row] = {}
    for start in by_name:
        branch: dict[str, Row] = {}
        name: str | None = start
        while name is not None and name not in ordered:
            parent = by_name[name]["parent"]
            if name in branch:
                raise parent.error("a parent that does not descend from this joint (a cycle)")
            branch[name] = by_name[name]
            name = parent_name(parent)
            if name is not None:
                parent.choice(by_name, f"`{WORLD}` or the name of a joint")
        ordered.update(reversed(branch.items()))
    return [*ordered.values()]


def axis(entry: Entry) -> Float[np.ndarray, "3"]:
    """A unit vector, from a letter or from three numbers of any length but zero."""
    expected = "an axis: x, -x, y, -y, z, -z or three numbers that are not all zero"
    if isinstance(entry.value, str):
        if entry.value not in UP_AXES:
            raise entry.error(expected)
        return axis_vector(entry.value)
    vector = np.array(entry.numbers(expected))
    length, tolerance = float(np.linalg.norm(vector)), 1e-6
    if length < tolerance:
        raise entry.error(expected)
    return vector if abs(length - 1.0) < tolerance else vector / length  # what `save_body` wrote loads as it was


def weights(entry: Entry, joints: Collection[str]) -> dict[str, float]:
    """The joints that a degree of freedom moves, with their weights."""
    expected = "a weight: a finite number other than 0"
    result = {}
    for joint, weight in entry.mapping().items():
        entry.part(joint).choice(joints, "the name of a joint")
        result[joint] = weight.number(expected)
        if result[joint] == 0.0:
            raise weight.error(expected)
    if not result:
        raise entry.error("at least one joint with its weight")
    return result


def limits(entry: Entry | None) -> tuple[float, float]:
    """Lower and upper limit; without limits, or with an empty bound, infinite."""
    if entry is None or entry.value in (None, "none"):
        return -np.inf, np.inf
    if not isinstance(entry.value, list) or len(entry.value) != 2:
        raise entry.error("[lower, upper] or none")
    low, high = entry.items()
    lower = -np.inf if low.value is None else low.number()
    upper = np.inf if high.value is None else high.number()
    if lower > upper:
        raise entry.error("the lower limit before the upper one")
    return lower, upper


def sigma(entry: Entry, metres: float) -> float:
    """The size of a blob, in metres."""
    size = metres * entry.number("a length over 0")
    if size < 1e-6:
        raise entry.error("a length over 0")
    return size


def color(row: Row, place: Entry, space: str) -> list[float]:
    """The colour of a blob, in the colour space of the file, under either spelling of the key."""
    spellings = [key for key in ("color", "colour") if key in row]
    if len(spellings) != 1:
        raise InputError(f"{place.path}: {place.key} needs one key `color`, three numbers in the space {space}")
    low, high = (0.0, 1.0) if space in ("rgb", "hsv") else (-1.5, 1.5)
    expected = f"three numbers from {low:g} to {high:g}: a colour in the space {space}"
    return row[spellings[0]].numbers(expected, low, high)


def pose(entry: Entry, dof_names: Sequence[str]) -> Float[np.ndarray, "dof"]:
    """The degrees of freedom of a named pose; what is not named is 0."""
    values = np.zeros(len(dof_names))
    for name, value in entry.mapping().items():
        entry.part(name).choice(dof_names, "the name of a degree of freedom")
        values[dof_names.index(name)] = value.number()
    return values


def shape_group(row: Row, known: dict[str, Sequence[str]]) -> ShapeGroup:
    """A shape parameter; `known` gives for each of its lists the names that may stand there."""
    scaled = {
        field: tuple(item.choice(options, f"the name of a {field.split('_')[0]}") for item in row[field].items())
        for field, options in known.items()
        if field in row
    }
    for field, members in scaled.items():
        if len(set(members)) < len(members):
            raise row[field].error("every name once")
    return ShapeGroup(name=row["name"].text(), **scaled)
