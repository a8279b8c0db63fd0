"""The ring of rendered cameras: where they stand, what they see, and how they turn light into pictures.

They are pinholes in plain numpy (OpenCV axes; pixel (0, 0) is the centre of the first pixel).
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float, UInt8

from sogjax.synth.light import srgb_from_linear
from sogjax.synth.settings import SynthSettings


@dataclass(frozen=True)
class View:
    """One calibrated camera."""

    name: str
    width: int
    height: int
    matrix: Float[np.ndarray, "3 3"]
    camera_from_world: Float[np.ndarray, "4 4"]
    distortion: Float[np.ndarray, "5"]

    def project(
        self, points_world: Float[np.ndarray, "n 3"]
    ) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n"]]:
        """Pixels of the recorded (distorted) picture and depths; behind the camera pixels mean nothing."""
        points = points_world @ self.camera_from_world[:3, :3].T + self.camera_from_world[:3, 3]
        depths = points[:, 2]
        rays = points[:, :2] / np.where(depths > 1e-3, depths, 1.0)[:, None]
        k1 = self.distortion[0]
        if k1 != 0.0:
            # Beyond the turning point of the polynomial the picture would fold over.
            squared = np.minimum((rays**2).sum(1), 1.0 / (3.0 * abs(k1)))
            rays = rays * (1.0 + k1 * squared)[:, None]
        focal = np.array([self.matrix[0, 0], self.matrix[1, 1]])
        return rays * focal + self.matrix[:2, 2], depths


def ring_of_views(settings: SynthSettings, rng: np.random.Generator) -> tuple[View, ...]:
    """Cameras around the centre, alternately low and high, all looking at it, none quite like another."""
    views = []
    for k in range(settings.cameras):
        angle = 2.0 * np.pi * (k + 0.15 * rng.uniform(-1, 1)) / settings.cameras
        radius = settings.radius * (1.0 + 0.02 * rng.uniform(-1, 1))
        height = (1.15, 2.35)[k % 2] + 0.08 * rng.uniform(-1, 1)
        centre = np.array([radius * np.cos(angle), radius * np.sin(angle), height])
        target = np.array([0.0, 0.0, 0.92]) + 0.06 * rng.uniform(-1, 1, 3)
        roll = np.deg2rad(1.5) * rng.uniform(-1, 1)
        focal = min(1.16 * settings.height, 0.87 * settings.width) * (1.0 + 0.04 * rng.uniform(-1, 1))
        aspect = 1.0 + 0.002 * rng.uniform(-1, 1)
        middle = (np.array([settings.width, settings.height]) - 1.0) / 2.0
        middle = middle + 0.01 * settings.width * rng.uniform(-1, 1, 2)
        views.append(
            View(
                name=f"cam{k:02d}",
                width=settings.width,
                height=settings.height,
                matrix=np.array([[focal, 0.0, middle[0]], [0.0, focal * aspect, middle[1]], [0.0, 0.0, 1.0]]),
                camera_from_world=_looking_at(centre, target, roll),
                distortion=np.array([settings.distortion, 0.0, 0.0, 0.0, 0.0]),
            )
        )
    return tuple(views)


def _looking_at(
    centre: Float[np.ndarray, "3"], target: Float[np.ndarray, "3"], roll: float
) -> Float[np.ndarray, "4 4"]:
    """Camera from world of a camera that looks at `target`, the world's z being up."""
    forward = (target - centre) / np.linalg.norm(target - centre)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    right, down = np.cos(roll) * right + np.sin(roll) * down, np.cos(roll) * down - np.sin(roll) * right
    transform = np.eye(4)
    transform[:3, :3] = np.stack([right, down, forward])
    transform[:3, 3] = -transform[:3, :3] @ centre
    return transform


@dataclass(frozen=True)
class Sensor:
    """How one camera turns light into numbers."""

    gain: Float[np.ndarray, "3"]
    noise: float
    """Standard deviation in units of the brightest value."""
    seed: int

    @classmethod
    def drawn(cls, settings: SynthSettings, rng: np.random.Generator) -> "Sensor":
        """A sensor with an exposure and a colour balance of its own."""
        spread = settings.camera_variation * np.clip(rng.standard_normal(4), -2.0, 2.0)
        return cls((1.0 + spread[0]) * (1.0 + spread[1:] / 3.0), settings.noise, settings.seed)

    def exposed(
        self, picture: Float[np.ndarray, "row column 3"], rng: np.random.Generator
    ) -> UInt8[np.ndarray, "row column 3"]:
        """The picture as recorded, BGR."""
        return self.recorded(self.without_noise(picture), rng)

    def without_noise(self, picture: Float[np.ndarray, "row column 3"]) -> Float[np.ndarray, "row column 3"]:
        """The picture in grey levels, BGR, as it would be recorded without noise."""
        rows = picture.reshape(len(picture), 3 * picture.shape[1]) * np.tile(
            self.gain.astype(np.float32), picture.shape[1]
        )
        values = np.ascontiguousarray(srgb_from_linear(rows.reshape(picture.shape))[..., ::-1])
        values *= np.float32(255.0)
        return values

    def recorded(
        self, levels: Float[np.ndarray, "row column 3"], rng: np.random.Generator
    ) -> UInt8[np.ndarray, "row column 3"]:
        """Grey levels, which are used up, with noise."""
        if self.noise > 0.0:
            bank = _noise_bank(self.seed)
            first = int(rng.integers(len(bank)))
            noise = bank[first : first + levels.size]
            if len(noise) < levels.size:  # the bank's beginning follows its end
                noise = np.concatenate([noise, np.resize(bank, levels.size - len(noise))])
            levels += np.float32(255.0 * self.noise) * noise.reshape(levels.shape)
        levels += np.float32(0.5)
        return np.clip(levels, 0.0, 255.0, out=levels).astype(np.uint8)


@cache
def _noise_bank(seed: int) -> Float[np.ndarray, "n"]:
    """Many normal numbers; pictures take theirs from it, which is ten times faster than drawing new ones."""
    return np.random.default_rng([seed, 31]).standard_normal(1 << 22, np.float32)
