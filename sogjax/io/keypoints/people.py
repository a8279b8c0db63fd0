"""People in pictures as detectors' files give them, before their scheme is known.

Which scheme the people of keypoint files follow: by how many keypoints they have, then by their shape.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.files import read_text
from sogjax.io.keypoints.scheme import LARGEST_COUNT, KeypointScheme, shipped_schemes

MOST_PEOPLE = 100
"""In a picture of a file; no detector finds more."""

FARTHEST_PIXEL = 1e6
"""Coordinates beyond it are of no picture."""

Person = Float[np.ndarray, "all_keypoints 3"]
"""x and y in pixels and confidence from 0 to 1; all three 0 where a keypoint was not found."""


@dataclass(frozen=True)
class Picture:
    """The people of one picture."""

    number: int | None
    """Of the picture, as the file counts; None where the file is of one picture and says no number."""
    people: tuple[Person, ...]


def read_json(path: Path, max_bytes: int) -> Any:
    """The content of a JSON file; NaN and Infinity, which some programs write, are taken as numbers.

    Raises:
        InputError: it cannot be read, is larger than `max_bytes`, or is no JSON.
    """
    text = read_text(path, max_bytes)
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())[:100]
        raise InputError(f"{path}: is not valid JSON ({reason}); run the detector again, or remove the file") from error


def person_of_triples(path: Path, values: Any) -> Person:
    """The keypoints x1, y1, c1, x2, y2, c2, ...

    Raises:
        InputError: no such list.
    """
    flat = numbers(values)
    if flat is None or flat.ndim != 1 or len(flat) % 3 or len(flat) > 3 * LARGEST_COUNT:
        raise InputError(f"{path}: the keypoints of a person are not x, y, confidence in turn; run the detector again")
    return cleaned(flat.reshape(-1, 3))


def numbers(values: Any) -> Float[np.ndarray, "..."] | None:
    """Nested lists of numbers as an array, null as NaN; None where they are something else."""
    if not isinstance(values, list):
        return None
    try:
        return np.array(values, float)
    except (TypeError, ValueError, OverflowError, RecursionError):
        return None


def cleaned(points: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
    """Keypoints with all numbers 0 where there is none: no confidence, or a number that is no place."""
    with np.errstate(invalid="ignore"):
        there = np.isfinite(points).all(-1) & (np.abs(points[..., :2]) < FARTHEST_PIXEL).all(-1) & (points[..., 2] > 0)
    kept = np.where(there[..., None], points, 0.0)
    kept[..., 2] = np.clip(kept[..., 2], 0.0, 1.0)
    return kept


def people_found(path: Path, people: Sequence[Person]) -> tuple[Person, ...]:
    """The people who have a keypoint at all.

    Raises:
        InputError: too many people, or two with different numbers of keypoints.
    """
    if len(people) > MOST_PEOPLE:
        raise InputError(f"{path}: has {len(people)} people in a picture, more than {MOST_PEOPLE}; is it damaged?")
    if len({len(person) for person in people if len(person)}) > 1:
        raise InputError(f"{path}: its people have different numbers of keypoints; run the detector again")
    return tuple(person for person in people if (person[:, 2] > 0.0).any())


_BONES = tuple(
    (f"{side}_{a}", f"{side}_{b}")
    for side in ("left", "right")
    for a, b in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
)
_LOOKED_AT = 200
"""People; more tell no more."""


def check_counts(people: Mapping[Path, Sequence[Person]], scheme: KeypointScheme | None) -> int | None:
    """The number of keypoints that all people have; None where there is nobody.

    Raises:
        InputError: it differs, or is not the scheme's.
    """
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
    return next(iter(counts), None)


def told_scheme(folder: Path, people: Sequence[Person]) -> KeypointScheme:
    """The scheme of people who all have the same number of keypoints; of several that fit, the one of shortest limbs.

    Raises:
        InputError: no known scheme has so many keypoints.
    """
    schemes = shipped_schemes()
    count = len(people[0])
    fitting = [scheme for scheme in schemes.values() if scheme.count == count]
    if not fitting:
        known = ", ".join(f"{scheme.name} {scheme.count}" for scheme in schemes.values())
        raise InputError(
            f"{folder}: its people have {count} keypoints, as in no known scheme ({known}); describe them in a file "
            "and name it as `keypoint_scheme:` in recording.yaml"
        )
    step = max(len(people) // _LOOKED_AT, 1)
    return min(fitting, key=lambda scheme: _limb_length(scheme, people[::step]))


def _limb_length(scheme: KeypointScheme, people: Sequence[Person]) -> float:
    """Mean length of the limbs, in units of each person's extent."""
    places = dict(zip(scheme.landmarks, scheme.indices, strict=True))
    bones = [(places[a], places[b]) for a, b in _BONES if a in places and b in places]
    lengths = []
    for person in people:
        there = person[:, 2] > 0.0
        extent = np.ptp(person[there, :2], axis=0).max()
        ends = [(a, b) for a, b in bones if there[a] and there[b]]
        if extent > 0.0 and ends:
            lengths += [np.linalg.norm(person[a, :2] - person[b, :2]) / extent for a, b in ends]
    return float(np.mean(lengths)) if lengths else np.inf
