"""People in pictures as detectors' files give them, before their scheme is known."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from sogjax.data.keypoints.scheme import LARGEST_COUNT
from sogjax.data.text_lines import read_text
from sogjax.errors import InputError

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
