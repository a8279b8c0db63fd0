"""The settings of a rendered recording."""

from dataclasses import dataclass

from sogjax.errors import InputError
from sogjax.settings.option import option

MOTIONS = ("walk", "arms", "squat_kick", "cartwheel", "pass")
ACTOR_NAMES = ("anna", "ben", "cleo", "dan")


@dataclass
class SynthSettings:
    """A rendered recording; everything in it follows from these values."""

    motion: str = option(
        "walk", "what the people do: walk, arms, squat_kick, cartwheel, or pass (several people pass closely)"
    )
    actors: int = option(1, "number of people, 1 to 4")
    cameras: int = option(12, "number of cameras in a ring around the people, at two heights in turn")
    width: int = option(648, "width of the pictures in pixels, even")
    height: int = option(486, "height of the pictures in pixels, even")
    fps: float = option(30.0, "frames per second")
    frames: int = option(60, "number of frames")
    seed: int = option(0, "people, clothes, room, cameras and noise are drawn from it")
    noise: float = option(0.012, "standard deviation of the sensor noise, in units of the brightest value")
    camera_variation: float = option(
        0.03, "standard deviation of the cameras' exposures (a share), and a third of it of their colour balance"
    )
    radius: float = option(4.0, "radius of the ring of cameras in metres, 3.5 to 4.5")
    distortion: float = option(0.0, "radial lens distortion k1 of all cameras (OpenCV's model), -0.3 to 0.1")
    example_poses: bool = option(True, "whether four still poses of each actor are photographed too, with masks")
    background: bool = option(True, "whether the empty scene is photographed too")
    shadows: bool = option(True, "whether people throw shadows")

    def check(self) -> None:
        """Refuse values that cannot be rendered.

        Raises:
            InputError: naming the setting, its value and what is allowed.
        """
        if self.motion not in MOTIONS:
            raise InputError(f"motion={self.motion!r} is not known; choose one of {', '.join(MOTIONS)}")
        if self.motion == "pass" and self.actors < 2:
            raise InputError(f"actors={self.actors}: the motion pass needs two people or more; set actors=2")
        self._check_range("actors", 1, len(ACTOR_NAMES))
        self._check_range("cameras", 1, 200)
        self._check_range("width", 64, 4096)
        self._check_range("height", 64, 4096)
        self._check_range("fps", 1.0, 1000.0)
        self._check_range("frames", 1, 100_000)
        self._check_range("seed", 0, 2**32 - 1)
        self._check_range("noise", 0.0, 0.5)
        self._check_range("camera_variation", 0.0, 0.2)
        self._check_range("radius", 3.5, 4.5)
        self._check_range("distortion", -0.3, 0.1)
        for name in ("width", "height"):
            if getattr(self, name) % 2:
                raise InputError(
                    f"{name}={getattr(self, name)} is odd, which video files do not support; use an even number"
                )

    @property
    def actor_names(self) -> tuple[str, ...]:
        """The people's names."""
        return ACTOR_NAMES[: self.actors]

    def _check_range(self, name: str, lowest: int | float, highest: int | float) -> None:
        value = getattr(self, name)
        if not lowest <= value <= highest:
            raise InputError(f"{name}={value} is out of range; choose a value from {lowest} to {highest}")
