"""Keypoint schemes: which place in another program's files is which point of the body, and which one files follow."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from sogjax.errors import InputError
from sogjax.io.actor_rows import filled_table, names
from sogjax.io.yaml_entry import read_yaml

LARGEST_COUNT = 1000
"""Keypoints of one person; no detector gives more."""

Person = Float[np.ndarray, "all_keypoints 3"]
"""x and y in pixels and confidence from 0 to 1; all three 0 where a keypoint was not found."""


@dataclass(frozen=True)
class KeypointScheme:
    """The keypoints that are used, of those that a detector's model has."""

    name: str
    count: int
    """How many keypoints a person has in the files, used or not."""
    keypoints: tuple[str, ...]
    indices: tuple[int, ...]
    """Their places in the files."""
    landmarks: tuple[str, ...]
    """The landmarks of the body that they mean."""
    within: tuple[float, ...]
    """Metres that a keypoint and its landmark may be apart."""

    def on(self, landmarks: Sequence[str]) -> Int[np.ndarray, "keypoint"]:
        """For each keypoint the index of its landmark among those of a body; -1 where the body has none such."""
        return np.array([landmarks.index(name) if name in landmarks else -1 for name in self.landmarks], int)

    @property
    def mirrored(self) -> Int[np.ndarray, "keypoint"]:
        """For each keypoint the index of the other side's; its own at the midline."""
        places = {name: k for k, name in enumerate(self.keypoints)}
        return np.array([places.get(other_side(name), k) for k, name in enumerate(self.keypoints)], int)

    def chosen(self, people: Float[np.ndarray, "person all_keypoints 3"]) -> Float[np.ndarray, "person keypoint 3"]:
        """The keypoints that are used."""
        return people[:, list(self.indices)]


def other_side(name: str) -> str:
    """A name with left and right exchanged: LKnee, left_knee; others stay."""
    for left, right in (("left", "right"), ("Left", "Right")):
        if left in name:
            return name.replace(left, right)
        if right in name:
            return name.replace(right, left)
    if len(name) > 1 and name[0] in "LR" and name[1].isupper():
        return ("R" if name[0] == "L" else "L") + name[1:]
    return name


def shipped_schemes() -> dict[str, KeypointScheme]:
    """The schemes that come with the package, by name."""
    found = [load_scheme(path) for path in sorted((Path(__file__).parent / "schemes").glob("*.yaml"))]
    return {scheme.name: scheme for scheme in found}


def named_scheme(name: str) -> KeypointScheme:
    """A scheme by its name, or by the path of its file.

    Raises:
        InputError: neither, or a file that is no scheme.
    """
    if name.endswith((".yaml", ".yml")):
        return load_scheme(Path(name))
    shipped = shipped_schemes()
    for known, scheme in shipped.items():
        if known.lower() == name.lower():
            return scheme
    raise InputError(f"no keypoint scheme {name!r} is known; choose one of {', '.join(shipped)}, or give a .yaml file")


def load_scheme(path: Path) -> KeypointScheme:
    """The scheme of a file: `name`, `count`, and `keypoints` with name, index, landmark and within (metres)."""
    content = read_yaml(path).fields(("name", "count", "keypoints"))
    count = content["count"].whole(f"a whole number from 1 to {LARGEST_COUNT}", 1, LARGEST_COUNT)
    rows = filled_table(content["keypoints"], ("name", "index", "landmark", "within"))
    place = f"a whole number from 0 to {count - 1}"
    indices = tuple(row["index"].whole(place, 0, count - 1) for row in rows)
    for row, index in zip(rows, indices, strict=True):
        if indices.count(index) > 1:
            raise row["index"].error("an index that no other keypoint has")
    distance = "a distance in metres from 0 to 1"
    return KeypointScheme(
        name=content["name"].text(),
        count=count,
        keypoints=names(rows),
        indices=indices,
        landmarks=tuple(row["landmark"].text() for row in rows),
        within=tuple(row["within"].number(distance, 0.0, 1.0) for row in rows),
    )


def check_counts(people: Mapping[Path, Sequence[Person]], scheme: KeypointScheme | None) -> None:
    """Check that all people have as many keypoints, the scheme's where one is given."""
    counts: dict[int, Path] = {}
    for path, found in people.items():
        for person in found:
            counts.setdefault(len(person), path)
    if scheme is not None:
        wrong = next((count for count in counts if count != scheme.count), None)
        if wrong is not None:
            raise InputError(
                f"{counts[wrong]}: its people have {wrong} keypoints, those of {scheme.name} have {scheme.count}; "
                "give the scheme of the files"
            )
    if len(counts) > 1:
        (one, here), (other, there) = list(counts.items())[:2]
        raise InputError(f"{here}: its people have {one} keypoints, those of {there} {other}; run one detector on all")


def told_scheme(folder: Path, people: Sequence[Person]) -> KeypointScheme:
    """The scheme of people who have the same number of keypoints; of several that fit, the one of shortest limbs."""
    schemes = shipped_schemes()
    count = len(people[0])
    fitting = [scheme for scheme in schemes.values() if scheme.count == count]
    if not fitting:
        known = ", ".join(f"{scheme.name} {scheme.count}" for scheme in schemes.values())
        raise InputError(
            f"{folder}: its people have {count} keypoints, as in no known scheme ({known}); describe them in a file "
            "and name it as `keypoint_scheme:` in recording.yaml"
        )
    step = max(len(people) // 200, 1)  # more people tell no more
    return min(fitting, key=lambda scheme: _limb_length(scheme, people[::step]))


def _limb_length(scheme: KeypointScheme, people: Sequence[Person]) -> float:
    """Mean length of the limbs, in units of each person's extent."""
    places = dict(zip(scheme.landmarks, scheme.indices, strict=True))
    limbs = (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
    named = [(f"{side}_{a}", f"{side}_{b}") for side in ("left", "right") for a, b in limbs]
    bones = [(places[a], places[b]) for a, b in named if a in places and b in places]
    lengths = []
    for person in people:
        there = person[:, 2] > 0.0
        extent = np.ptp(person[there, :2], axis=0).max()
        ends = [(a, b) for a, b in bones if there[a] and there[b]]
        if extent > 0.0 and ends:
            lengths += [np.linalg.norm(person[a, :2] - person[b, :2]) / extent for a, b in ends]
    return float(np.mean(lengths)) if lengths else np.inf
