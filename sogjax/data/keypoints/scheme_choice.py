"""Which scheme the people of keypoint files follow: by how many keypoints they have, then by their shape."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from sogjax.data.keypoints.people import Person
from sogjax.data.keypoints.scheme import KeypointScheme, shipped_schemes
from sogjax.errors import InputError

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
