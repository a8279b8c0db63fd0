"""The settings of a rendered recording."""

from dataclasses import dataclass

from sogjax.errors import InputError
from sogjax.settings.option import expert, option

PAIRED = ("hug", "fight", "embrace", "talk", "couple")
"""Motions of two people close together."""
MOTIONS = (
    *("walk", "arms", "squat_kick", "cartwheel", "pass", "run", "sit", "throw", "dance", "stoop"),
    *PAIRED,
)
AMONG = ("table", "chairs", "table_and_chairs", "counter", "board")
"""Furniture among the people."""
AROUND = ("screen", "fence")
"""Furniture between all people and some of the cameras."""
PROPS = ("auto", "none", *AMONG, *AROUND)
OUTFITS = ("random", "patterned", "striped", "plain", "black_suit", "long_sleeves", "alike")
ROOMS = ("cluttered", "camouflage", "plain", "green")
ACTOR_NAMES = ("anna", "ben", "cleo", "dan")
_RANGES = {
    **{"cameras": (1, 200), "width": (64, 4096), "height": (64, 4096), "fps": (1.0, 1000.0), "frames": (1, 100_000)},
    **{"seed": (0, 2**32 - 1), "noise": (0.0, 0.5), "camera_variation": (0.0, 0.2), "radius": (3.5, 4.5)},
    **{"distortion": (-0.3, 0.1), "light_drift": (0.0, 0.6)},
}
"""Lowest and highest value of the settings that are numbers."""


@dataclass
class SynthSettings:
    """A rendered recording; everything in it follows from these values."""

    motion: str = option(
        "walk",
        "what the people do: walk, run, arms, squat_kick, cartwheel, throw, dance, stoop (and reach on the spot), sit "
        "(down at a table), pass (each other closely); two people: hug, embrace (for most of the clip), talk (at arm's "
        "length), couple (who dance), fight",
    )
    actors: int = option(1, "number of people, 1 to 4")
    cameras: int = option(12, "number of cameras in a ring around the people, at two heights in turn")
    width: int = option(648, "width of the pictures in pixels, even")
    height: int = option(486, "height of the pictures in pixels, even")
    fps: float = option(30.0, "frames per second")
    frames: int = option(60, "number of frames")
    seed: int = option(0, "people, clothes, room, cameras and noise are drawn from it")
    noise: float = expert(0.012, "standard deviation of the sensor noise, in units of the brightest value")
    camera_variation: float = expert(
        0.03, "standard deviation of the cameras' exposures (a share), and a third of it of their colour balance"
    )
    radius: float = expert(4.0, "radius of the ring of cameras in metres, 3.5 to 4.5")
    distortion: float = expert(0.0, "radial lens distortion k1 of all cameras (OpenCV's model), -0.3 to 0.1")
    example_poses: bool = option(True, "whether four still poses of each actor are photographed too, with masks")
    background: bool = option(True, "whether the empty scene is photographed too")
    shadows: bool = expert(True, "whether people throw shadows")
    props: str = option(
        "auto",
        "furniture, in the plates too but not in the example poses: none, table, chairs, table_and_chairs, counter "
        "(hides legs), board (hides the trunk), screen (hides people from 3 of 12 cameras), fence (hides legs from all "
        "low cameras); auto: table_and_chairs where somebody sits, else none",
    )
    outfit: str = option(
        "random",
        "clothes: random, patterned or striped (shirt and trousers), plain (one colour from neck to shoes), "
        "black_suit, long_sleeves (random, with sleeves to the wrists), alike (random, the same for everybody)",
    )
    room: str = option(
        "cluttered",
        "room: cluttered, camouflage (cluttered, in the colours of the people's skin and clothes), plain, green",
    )
    light_drift: float = option(
        0.0, "share of the light that is lost over the clip, 0 to 0.6, most of it blue; plates show the beginning"
    )

    alone: bool = expert(
        False, "whether the first of the two people of a motion does the same without the other one; with actors=1"
    )

    def check(self) -> None:
        """Refuse values that cannot be rendered.

        Raises:
            InputError: naming the setting, its value and what is allowed.
        """
        for name, choices in (("motion", MOTIONS), ("props", PROPS), ("outfit", OUTFITS), ("room", ROOMS)):
            if getattr(self, name) not in choices:
                raise InputError(f"{name}={getattr(self, name)!r} is not known; choose one of {', '.join(choices)}")
        self._check_range("actors", 1, len(ACTOR_NAMES))
        self._check_people()
        self._check_props()
        for name, (lowest, highest) in _RANGES.items():
            self._check_range(name, lowest, highest)
        for name in ("width", "height"):
            if getattr(self, name) % 2:
                raise InputError(
                    f"{name}={getattr(self, name)} is odd, which video files do not support; use an even number"
                )

    @property
    def actor_names(self) -> tuple[str, ...]:
        """The people's names."""
        return ACTOR_NAMES[: self.actors]

    @property
    def roles(self) -> int:
        """How many people the motion is made for."""
        return 2 if self.alone else self.actors

    @property
    def furniture(self) -> str:
        """What stands among the people: one of PROPS but auto."""
        if self.props == "auto":
            return "table_and_chairs" if self.motion == "sit" else "none"
        return self.props

    @property
    def stands_among(self) -> bool:
        """Whether furniture stands among the people."""
        return self.furniture in AMONG

    def _check_people(self) -> None:
        if self.motion == "pass" and self.actors < 2:
            raise InputError(f"actors={self.actors}: the motion pass needs two people or more; set actors=2")
        if self.alone and self.motion not in PAIRED:
            raise InputError(f"alone=true: the motion {self.motion} is not one of two people; leave it out")
        if self.alone and self.actors != 1:
            raise InputError(f"alone=true actors={self.actors}: one of two people is alone; set actors=1")
        if self.motion in PAIRED and not self.alone and self.actors != 2:
            raise InputError(f"actors={self.actors}: the motion {self.motion} needs two people; set actors=2")

    def _check_props(self) -> None:
        if self.motion == "sit" and "chairs" not in self.furniture:
            raise InputError(f"props={self.props}: the motion sit needs a chair; leave props out or set props=chairs")
        if self.stands_among and (self.motion == "pass" or (self.motion == "walk" and self.actors > 1)):
            raise InputError(
                f"props={self.props}: people who walk past each other need the floor; set props=none, screen or fence, "
                "actors=1 with motion=walk, or another motion"
            )

    def _check_range(self, name: str, lowest: int | float, highest: int | float) -> None:
        value = getattr(self, name)
        if not lowest <= value <= highest:
            raise InputError(f"{name}={value} is out of range; choose a value from {lowest} to {highest}")
