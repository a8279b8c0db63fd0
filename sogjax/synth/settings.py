"""The settings of a rendered recording."""

from dataclasses import dataclass

from sogjax.errors import InputError

MOTIONS = ("walk", "arms", "squat_kick", "cartwheel", "pass")
ACTOR_NAMES = ("anna", "ben", "cleo", "dan")


@dataclass
class SynthSettings:
    """A rendered recording; everything in it follows from these values."""

    motion: str = "walk"
    """What the people do: walk, arms, squat_kick, cartwheel, or pass (several people pass closely)."""
    actors: int = 1
    """Number of people, 1 to 4."""
    cameras: int = 12
    """Number of cameras in a ring around the people, at two heights in turn."""
    width: int = 648
    """Width of the pictures in pixels, even."""
    height: int = 486
    """Height of the pictures in pixels, even."""
    fps: float = 30.0
    """Frames per second."""
    frames: int = 60
    """Number of frames."""
    seed: int = 0
    """People, clothes, room, cameras and noise are drawn from it."""
    noise: float = 0.012
    """Standard deviation of the sensor noise, in units of the brightest value."""
    camera_variation: float = 0.03
    """Standard deviation of the cameras' exposures (a share), and a third of it of their colour balance."""
    radius: float = 4.0
    """Radius of the ring of cameras in metres, 3.5 to 4.5."""
    distortion: float = 0.0
    """Radial lens distortion k1 of all cameras (OpenCV's model), -0.3 to 0.1."""
    example_poses: bool = True
    """Whether four still poses of each actor are photographed too, with masks."""
    background: bool = True
    """Whether the empty scene is photographed too."""
    shadows: bool = True
    """Whether people throw shadows."""

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
