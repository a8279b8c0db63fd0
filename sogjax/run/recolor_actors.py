"""Actors whose limbs take the colours that they show where they were tracked, with which the clip is tracked again.

An arm that was not found in the frames that an actor is made of took the colours of what is there. Over the clip it was
mostly found, and of left and right, frame by frame, what is alike tells the colours of both.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sogjax.actor.colors import Samples, colored, colors_of, joined_samples
from sogjax.actor.limb_colors import agreed_samples, limb_pairs_alike
from sogjax.io.files import write_json
from sogjax.io.frame_motions import ClipFacts, motions_of
from sogjax.io.frame_table import FramesRecord, FrameTable
from sogjax.io.motion import Motion
from sogjax.io.npz_file import read_npz, save_npz
from sogjax.model.body import Body
from sogjax.model.limbs import limb_names
from sogjax.quality.jumps import jumps
from sogjax.quality.limb_warnings import doubtful_limbs
from sogjax.quality.passages import passages
from sogjax.run.actors import Actors
from sogjax.run.adjust_colors import more_doubtful
from sogjax.run.clip_sides import colors_by_frame
from sogjax.run.clock import StageTimes
from sogjax.run.forward import track_forward
from sogjax.run.initial_pose import InitialPose
from sogjax.run.merge import merge_backward
from sogjax.run.setup import Setup, with_bodies
from sogjax.run.terminal import say

FOLDER, LAST = "recolored", "made.json"
TRACKED = "the clip as it was tracked"
"""Source of the pose with which tracking begins again."""
OTHER = 0.08
"""Mean distance of the blobs' colours (sRGB, 0 to 1) from which on a limb shows others than the actor's."""


@dataclass(frozen=True)
class RecoloredActors(FramesRecord):
    """The frames, tracked again with the actors' new colours, if these doubt less."""

    actors: Actors | None = None
    """In new colours; None: the old ones hold, and the frames are as they were."""

    def save(self, folder: Path) -> None:
        """Keep it in a run's folder; a note comes last."""
        (folder / FOLDER).mkdir(exist_ok=True)
        if self.actors is not None:
            self.actors.save(folder / FOLDER)
        save_npz(folder / FOLDER / self.file, self.table.arrays())
        write_json(folder / FOLDER / LAST, {"made": self.actors is not None})

    @classmethod
    def load(cls, folder: Path) -> "RecoloredActors | None":
        """What was kept, if all of it was."""
        place = folder / FOLDER
        if not (place / LAST).is_file():
            return None
        return cls(FrameTable.from_arrays(read_npz(place / cls.file)), Actors.load(place))


def recolor_actors(
    setup: Setup, actors: Actors, tracked: FrameTable, color_space: str, both_ways: bool
) -> RecoloredActors:
    """The clip tracked again with limbs in the colours that they show in it, where these are others than the actors'.

    Args:
        setup: what was tracked with.
        actors: of it, each in its own upright frame.
        tracked: the frames.
        color_space: in which colours are averaged.
        both_ways: whether limbs are searched over the clip then, as before.

    Raises:
        InputError: a video cannot be read, or a picture has too many image blobs.
    """
    motions = motions_of(tracked, setup.bodies, ClipFacts.of(setup.clip.recording))
    of_actors = {body.name: (body, motions[body.name]) for body in setup.bodies}
    said = dict(zip(of_actors, actors.unlike, strict=False))
    named = {name: named_limbs(*of_actor, said.get(name, "")) for name, of_actor in of_actors.items()}
    if not any(named.values()):
        return RecoloredActors(tracked)
    shown = colors_by_frame(setup.clip.recording, of_actors)
    found = [recolored(body, named[body.name], shown[body.name], color_space) for body in setup.bodies]
    told = [f"{body.name}: {', '.join(taken)}" for body, taken in found if taken]
    if not told:
        return RecoloredActors(tracked)
    say(f"tracked again with the colours that limbs show where they were tracked ({'; '.join(told)})")
    bodies = tuple(body for body, _ in found)
    again, row = with_bodies(setup, bodies), surest_row(tracked)
    begin = InitialPose(setup.clip.numbers[row], np.asarray(tracked.pose[row]), TRACKED)
    table = track_forward(again, begin, StageTimes())
    table = merge_backward(again, table, tracked.pose).table if both_ways else table
    if more_doubtful(table, tracked):
        say("the clip stays as it was, since limbs are more doubtful in the new colours")
        return RecoloredActors(tracked)
    pairs = zip(actors.bodies, bodies, strict=True)
    new = tuple(colored(actor, np.asarray(body.blob_colors, float)) for actor, body in pairs)
    return RecoloredActors(table, replace(actors, bodies=new))


def named_limbs(body: Body, motion: Motion, unlike: str) -> set[str]:
    """The limbs that a verdict would name: in doubt, jumping, through others, or not found in the actor's frames."""
    said = [*map(str, doubtful_limbs(motion)), *jumps(body, motion), *passages(body, motion), unlike]
    return {name for name in limb_names(body) if any(name in sentence for sentence in said)}


def surest_row(table: FrameTable) -> int:
    """The row in which the limb that is most in doubt is least so; the first one where nothing is known of doubts."""
    return 0 if table.limb_doubt is None else int(np.argmin(np.max(table.limb_doubt, axis=1, initial=0.0)))


def recolored(body: Body, named: set[str], by_frame: Mapping[int, Samples], color_space: str) -> tuple[Body, list[str]]:
    """A body whose named limbs have the colours that frames show of them, if these are others; and which these are.

    A limb goes with its counterpart. Pairs that are unlike in most frames keep theirs.
    """
    samples = [*by_frame.values()]
    shown = colors_of(body, joined_samples(samples), color_space).colors
    agreed = agreed_samples(body, samples, shown)
    shown, own, names = (
        colors_of(body, agreed.samples, color_space).colors,
        np.asarray(body.blob_colors),
        limb_names(body),
    )
    new, taken = own.copy(), list[str]()
    for pair in limb_pairs_alike(body):
        both = [names[k] for k in pair.limbs]
        off = max(np.linalg.norm(own[blobs] - shown[blobs], axis=1).mean() for blobs in pair.blobs)
        if off > OTHER and named.intersection(both) and pair.limbs not in [each.limbs for each in agreed.unlike]:
            taken.append(" and ".join(both))
            for blobs in pair.blobs:
                new[blobs] = shown[blobs]
    return (colored(body, np.asarray(new, float)) if taken else body), taken
