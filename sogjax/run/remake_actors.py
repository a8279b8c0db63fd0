"""Actors that are made again once tracking told more of the background: several, or one that is doubtful.

Who hardly leaves his place hides what is behind him, and masks say nothing where the background is unknown: arms are
found in the wrong places, and take the colours of what is there. Once the body was tracked, most of it is known.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sogjax.actor.doubts import FRAMES_SUIT
from sogjax.actor.make import MadeActor
from sogjax.errors import InputError
from sogjax.io.files import write_json
from sogjax.model.body import Body
from sogjax.quality.proportions import size_beside
from sogjax.run.actors import ActorRequest, Actors, new_actors
from sogjax.run.background import Background
from sogjax.run.example_frames import need_background
from sogjax.run.initial_pose import InitialPose, PoseRequest, PoseSource, find_initial_pose
from sogjax.run.recordings import body_named
from sogjax.run.terminal import say

FOLDER, LAST = "remade", "made.json"
MUCH = 0.03
"""By how much less the masks of frames that hardly suit must agree with new actors for these to be worse (IoU)."""
SAME_SIZE = 0.15
"""Logarithm of a factor: sizes of one person differ by less. Those of 111 actors were right within 0.04, one by 0.34
too small: who was made again of masks that said nothing of most of him."""


@dataclass(frozen=True)
class RemadeActors:
    """What was made again; None: the first ones hold."""

    actors: Actors | None = None
    initial_pose: InitialPose | None = None
    """Where tracking begins with these actors."""

    def save(self, folder: Path) -> None:
        """Keep it in a run's folder; a note comes last."""
        (folder / FOLDER).mkdir(exist_ok=True)
        for record in (self.actors, self.initial_pose):
            if record is not None:
                record.save(folder / FOLDER)
        write_json(folder / FOLDER / LAST, {"made": self.actors is not None})

    @classmethod
    def load(cls, folder: Path) -> "RemadeActors | None":
        """What was kept, if all of it was."""
        place = folder / FOLDER
        return cls(Actors.load(place), InitialPose.load(place)) if (place / LAST).is_file() else None


def may_gain(request: ActorRequest, first: Actors) -> bool:
    """Whether the actors are several or doubtful, and made of masks that a background tells which was learnt.

    Of several people more is unknown, and what was wrong is not always noticed. Those that are given have no doubts.
    """
    recording = request.recording
    of_masks = not recording.example_poses or need_background(recording)
    return request.files is None and (len(first.doubts) > 1 or any((*first.doubts, *first.unlike))) and of_masks


def remake_actors(
    request: ActorRequest,
    first: Actors,
    background: Background,
    begin: PoseRequest,
    sources: Sequence[PoseSource],
    report: Callable[[Sequence[MadeActor]], object],
) -> RemadeActors:
    """The actors made again with a better background, and where tracking begins with them.

    Args:
        request: the actors that are wanted.
        first: as they were made.
        background: that is known by now.
        begin: the initial pose that is wanted.
        sources: of initial poses.
        report: takes how the actors were made, where they are taken: unless more of them are doubtful. Limbs that were
            not found do not count: colours tell some, and of the better background more.
    """
    names = ", ".join(body.name for body in first.bodies)
    say(f"{names}: made again, since more of the background is known now")
    made: list[MadeActor] = []
    try:
        actors = new_actors(replace(request, background=lambda: background), made.extend)
        if (reason := _why_worse(body_named(request.body), first, actors)) is not None:
            say(f"the first actors are kept, since {reason}")
            return RemadeActors()
        begun = find_initial_pose(replace(begin, actors=actors, background=background), sources)
    except InputError as error:
        say(f"the first actors are kept, since no new ones can be made ({error})")
        return RemadeActors()
    report(made)
    return RemadeActors(actors, begun)


def _why_worse(start: Body, first: Actors, again: Actors) -> str | None:
    """Why actors that were made again are worse than the first; None: nothing says so.

    Of two very different sizes of somebody one is wrong: that which is farther from the starting body's. Several people
    are told apart by their sizes.
    """
    suits_less = again.overlap < min(FRAMES_SUIT, first.overlap - MUCH)
    if suits_less or sum(map(bool, again.doubts)) > sum(map(bool, first.doubts)):
        return "the sizes of the new ones are more doubtful"
    sizes = [sorted(size_beside(start, body) or 1.0 for body in actors.bodies) for actors in (first, again)]
    for before, after in zip(*np.log(sizes), strict=True):
        if abs(after - before) > SAME_SIZE and abs(after) > abs(before):
            return f"somebody's bones would be {np.exp(after - before):.0%} as long as the first time"
    return None
