"""How the rendered cameras turn light into pictures: exposure, colour balance, noise."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float, UInt8

from sogjax.synth import light

_NOISE_BANK = 1 << 22


@cache
def _noise_bank(seed: int) -> Float[np.ndarray, "n"]:
    """Many normal numbers; pictures take theirs from it, which is ten times faster than drawing new ones."""
    return np.random.default_rng([seed, 31]).standard_normal(_NOISE_BANK, np.float32)


@dataclass(frozen=True)
class Sensor:
    """How one camera turns light into numbers."""

    gain: Float[np.ndarray, "3"]
    noise: float
    """Standard deviation in units of the brightest value."""
    seed: int = 0

    def exposed(
        self, picture: Float[np.ndarray, "row column 3"], rng: np.random.Generator
    ) -> UInt8[np.ndarray, "row column 3"]:
        """The picture as recorded, BGR."""
        values = light.srgb_from_linear(picture[..., ::-1] * self.gain[::-1].astype(np.float32)) * np.float32(255.0)
        if self.noise > 0.0:
            first = int(rng.integers(_NOISE_BANK))
            noise = np.take(_noise_bank(self.seed), np.arange(first, first + values.size), mode="wrap")
            values += np.float32(255.0 * self.noise) * noise.reshape(values.shape)
        return np.clip(values + 0.5, 0.0, 255.0).astype(np.uint8)
