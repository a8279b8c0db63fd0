"""All that a recording shows, made from its settings: people and their motions, the room, the cameras."""

from dataclasses import dataclass

import numpy as np

from sogjax.synth.anatomy import Pose, anatomy_from_seed
from sogjax.synth.clothes import outfits_from_seed, without_green
from sogjax.synth.exercises import EXAMPLE_POSES, standing_pose
from sogjax.synth.figure import Figure, make_figure
from sogjax.synth.furniture import furniture
from sogjax.synth.motions import Motion, furniture_sites, motions_of
from sogjax.synth.rooms import room_of
from sogjax.synth.scene import Scene, assembled
from sogjax.synth.settings import SynthSettings
from sogjax.synth.views import Sensor, View, ring_of_views

_PEOPLE, _ROOM, _VIEWS, _MOTIONS, _SENSORS = range(5)
"""Independent streams of random numbers: one more camera changes no clothes."""


@dataclass(frozen=True)
class Stage:
    """What is filmed, and by which cameras."""

    settings: SynthSettings
    people: tuple[Figure, ...]
    motions: tuple[Motion, ...]
    scene: Scene
    bare: Scene
    """The scene without furniture."""
    views: tuple[View, ...]
    sensors: tuple[Sensor, ...]

    def poses(self, frame: int) -> list[Pose]:
        """How the people stand in a frame."""
        return [motion(frame / self.settings.fps) for motion in self.motions]

    def example_pose(self, actor: int, name: str) -> Pose:
        """A still pose of one person in the middle of the room."""
        anatomy = self.people[actor].anatomy
        heading = 0.3 + 0.25 * list(EXAMPLE_POSES).index(name)
        return standing_pose(anatomy, EXAMPLE_POSES[name], np.zeros(3), heading)


def stage_of(settings: SynthSettings) -> Stage:
    """Make everything; the same settings make the same things."""
    stream = lambda *key: np.random.default_rng([settings.seed, *key])
    outfits = outfits_from_seed(stream(_PEOPLE, 100), settings.roles, settings.outfit)
    if settings.room == "green":
        outfits = [without_green(outfit) for outfit in outfits]
    anatomies = [anatomy_from_seed(stream(_PEOPLE, number)) for number in range(settings.roles)]
    people = [make_figure(*both) for both in zip(anatomies, outfits, strict=True)][: settings.actors]
    room = room_of(settings.room, outfits, stream(_ROOM))
    bare = assembled(room)
    sites = furniture_sites(settings.motion, settings.roles, stream(_MOTIONS))
    motions = motions_of(settings.motion, anatomies, stream(_MOTIONS), settings.stands_among)
    furnished = settings.furniture != "none"
    return Stage(
        settings=settings,
        people=tuple(people),
        motions=tuple(motions[: settings.actors]),
        scene=assembled(room, furniture(settings.furniture, sites)) if furnished else bare,
        bare=bare,
        views=ring_of_views(settings, stream(_VIEWS)),
        sensors=tuple(Sensor.drawn(settings, stream(_SENSORS, k)) for k in range(settings.cameras)),
    )
