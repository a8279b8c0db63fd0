"""A simulated keypoint detector: what it sees of true points, with the mistakes that real ones make."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.errors import InputError
from sogjax.settings.option import expert, option

PROGRAMS = ("none", "openpose", "pose2sim", "mmpose", "alphapose", "mediapipe")

_HIDDEN_NOISE = 3.0
"""Times as much noise as where a keypoint is seen."""
_HIDDEN_FOUND = 0.4
"""Share of the hidden keypoints that the detector guesses."""
_OUTLIER_REACH = 0.6
"""Heights of the person within which gross outliers lie from the truth, both ways."""
_SEEN_CONFIDENCE, _HIDDEN_CONFIDENCE = (9.0, 2.0), (4.0, 6.0)
"""Parameters of Beta distributions with means 0.82 and 0.4."""
_OUTLIER_CONFIDENCE = (5.0, 4.0)


@dataclass
class DetectorSettings:
    """A simulated detector; what it finds follows from these values and a seed."""

    keypoints: str = option(
        "none",
        "simulated keypoint files beside the recording, as a program writes them: none, openpose, pose2sim (RTMPose), "
        "mmpose, alphapose, mediapipe",
    )
    keypoint_scheme: str | None = expert(
        None, "their scheme, by name or file; null: the program's usual one, as BODY_25 of openpose"
    )
    keypoint_noise: float = expert(5.0, "their noise, pixels on each axis where a person is 1000 pixels tall")
    keypoint_outliers: float = expert(0.05, "share of keypoints that are gross outliers")
    keypoint_exchanges: float = expert(
        0.03, "share of people in pictures whose left and right arms, legs or both are exchanged"
    )
    keypoint_strangers: float = expert(0.05, "share of pictures in which somebody is found who is not there")
    keypoint_bias: float = expert(
        0.0, "metres by which each keypoint of a person is off in the same direction of its bone in all pictures"
    )
    keypoint_missing: float = expert(0.0, "share of pictures without a file")

    def check(self) -> None:
        """Refuse values that cannot be simulated.

        Raises:
            InputError: naming the setting, its value and what is allowed.
        """
        if self.keypoints not in PROGRAMS:
            raise InputError(f"keypoints={self.keypoints!r} is not known; choose one of {', '.join(PROGRAMS)}")
        if not 0.0 <= self.keypoint_noise <= 1000.0:
            raise InputError(f"keypoint_noise={self.keypoint_noise} is out of range; choose a value from 0 to 1000")
        if not 0.0 <= self.keypoint_bias <= 0.5:
            raise InputError(f"keypoint_bias={self.keypoint_bias} is out of range; choose metres from 0 to 0.5")
        for name in ("outliers", "exchanges", "strangers", "missing"):
            value = getattr(self, f"keypoint_{name}")
            if not 0.0 <= value <= 1.0:
                raise InputError(f"keypoint_{name}={value} is out of range; choose a share from 0 to 1")


@dataclass(frozen=True)
class Sight:
    """What a camera could see of the people's true keypoints in one picture."""

    pixels: Float[np.ndarray, "person keypoint 2"]
    inside: Bool[np.ndarray, "person keypoint"]
    """Whether they lie in the picture."""
    hidden: Bool[np.ndarray, "person keypoint"]
    """Whether something stands before them."""
    heights: Float[np.ndarray, "person"]
    """Pixels that each person measures, standing."""


def detected(
    sight: Sight,
    mirrored: Int[np.ndarray, "keypoint"],
    of_legs: Bool[np.ndarray, "keypoint"],
    settings: DetectorSettings,
    rng: np.random.Generator,
) -> Float[np.ndarray, "found keypoint 3"]:
    """What the detector says of a picture, people in no order; x, y, confidence, all 0 where it finds nothing."""
    people = [_person(sight, number, mirrored, of_legs, settings, rng) for number in range(len(sight.pixels))]
    people += [_stranger(sight, rng)] if rng.random() < settings.keypoint_strangers else []
    return np.stack([people[k] for k in rng.permutation(len(people))])


def _person(
    sight: Sight,
    number: int,
    mirrored: Int[np.ndarray, "keypoint"],
    of_legs: Bool[np.ndarray, "keypoint"],
    settings: DetectorSettings,
    rng: np.random.Generator,
) -> Float[np.ndarray, "keypoint 3"]:
    true, hidden, height = sight.pixels[number], sight.hidden[number], sight.heights[number]
    count = len(true)
    noise = settings.keypoint_noise * height / 1000.0 * np.where(hidden, _HIDDEN_NOISE, 1.0)
    pixels = true + noise[:, None] * rng.standard_normal((count, 2))
    sure, guessed = rng.beta(*_SEEN_CONFIDENCE, count), rng.beta(*_HIDDEN_CONFIDENCE, count)
    confidence = np.where(hidden, guessed * (rng.random(count) < _HIDDEN_FOUND), sure)
    outlier = (rng.random(count) < settings.keypoint_outliers) & (confidence > 0.0)
    elsewhere = true + _OUTLIER_REACH * height * rng.uniform(-1.0, 1.0, (count, 2))
    pixels = np.where(outlier[:, None], elsewhere, pixels)
    confidence = np.where(outlier, rng.beta(*_OUTLIER_CONFIDENCE, count), confidence)
    found = np.column_stack([pixels, confidence])
    exchange, parts = rng.random() < settings.keypoint_exchanges, rng.integers(3)
    if exchange:
        chosen = of_legs if parts == 0 else ~of_legs if parts == 1 else np.ones(count, bool)
        found = np.where(chosen[:, None], found[mirrored], found)
    return found * (sight.inside[number] & (confidence > 0.0))[:, None]


def _stranger(sight: Sight, rng: np.random.Generator) -> Float[np.ndarray, "keypoint 3"]:
    """Somebody as large as half of a person to all of it, elsewhere in the picture."""
    shape, height = sight.pixels[0] - sight.pixels[0].mean(0), sight.heights[0]
    turned = shape * np.array([rng.choice([-1.0, 1.0]), 1.0]) * rng.uniform(0.5, 1.0)
    away = height * rng.uniform(0.4, 1.2) * np.array([rng.choice([-1.0, 1.0]), 0.3 * rng.uniform(-1.0, 1.0)])
    pixels = sight.pixels[0].mean(0) + away + turned + 0.01 * height * rng.standard_normal(shape.shape)
    confidence = rng.beta(*_OUTLIER_CONFIDENCE, len(shape))
    return np.column_stack([pixels, confidence]) * (rng.random(len(shape)) < 0.8)[:, None]
