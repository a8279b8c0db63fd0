"""All that a recording shows, made from its settings: people and their motions, the room, the cameras."""

from dataclasses import dataclass

import numpy as np

from sogjax.synth.anatomy import Pose, anatomy_from_seed
from sogjax.synth.clothes import outfits_from_seed, without_green
from sogjax.synth.exercises import EXAMPLE_POSES, standing_pose
from sogjax.synth.figure import make_figure
from sogjax.synth.furniture import furniture
from sogjax.synth.motions import Motion, furniture_sites, motions_of
from sogjax.synth.picture import Person
from sogjax.synth.rooms import room_of
from sogjax.synth.scene import Scene, assembled
from sogjax.synth.sensor import Sensor
from sogjax.synth.settings import SynthSettings
from sogjax.synth.views import View, ring_of_views

_PEOPLE, _ROOM, _VIEWS, _MOTIONS, _SENSORS = range(5)
"""Independent streams of random numbers: one more camera changes no clothes."""


@dataclass(frozen=True)
class Stage:
    """What is filmed, and by which cameras."""

    settings: SynthSettings
    people: tuple[Person, ...]
    motions: tuple[Motion, ...]
    scene: Scene
    bare: Scene
    """The scene without furniture among the people."""
    views: tuple[View, ...]
    sensors: tuple[Sensor, ...]

    def poses(self, frame: int) -> list[Pose]:
        """How the people stand in a frame."""
        return [motion(frame / self.settings.fps) for motion in self.motions]

    def example_pose(self, actor: int, name: str) -> Pose:
        """A still pose of one person in the middle of the room."""
        anatomy = self.people[actor].figure.anatomy
        heading = 0.3 + 0.25 * list(EXAMPLE_POSES).index(name)
        return standing_pose(anatomy, EXAMPLE_POSES[name], np.zeros(3), heading)


def stage_of(settings: SynthSettings) -> Stage:
    """Make everything; the same settings make the same things."""
    stream = lambda *key: np.random.default_rng([settings.seed, *key])
    outfits = outfits_from_seed(stream(_PEOPLE, 100), settings.actors, settings.outfit)
    if settings.room == "green":
        outfits = [without_green(outfit) for outfit in outfits]
    people = []
    for number, outfit in enumerate(outfits):
        anatomy = anatomy_from_seed(stream(_PEOPLE, number))
        people.append(Person.dressed(make_figure(anatomy, outfit)))
    anatomies = [person.figure.anatomy for person in people]
    room = room_of(settings.room, outfits, stream(_ROOM))
    bare = assembled(room)
    sites = furniture_sites(settings.motion, settings.actors, stream(_MOTIONS))
    furnished = settings.furniture != "none"
    return Stage(
        settings=settings,
        people=tuple(people),
        motions=tuple(motions_of(settings.motion, anatomies, stream(_MOTIONS), furnished)),
        scene=assembled(room, furniture(settings.furniture, sites)) if furnished else bare,
        bare=bare,
        views=ring_of_views(settings, stream(_VIEWS)),
        sensors=tuple(_sensor(settings, stream(_SENSORS, k)) for k in range(settings.cameras)),
    )


def _sensor(settings: SynthSettings, rng: np.random.Generator) -> Sensor:
    spread = settings.camera_variation * np.clip(rng.standard_normal(4), -2.0, 2.0)
    return Sensor(gain=(1.0 + spread[0]) * (1.0 + spread[1:] / 3.0), noise=settings.noise, seed=settings.seed)
