"""Actors whose limbs take the colours that they show where they were tracked, with which the clip is tracked again.

An arm that was not found in the frames that an actor is made of took the colours of what is there. Over the clip it was
mostly found, and of left and right, frame by frame, what is alike tells the colours of both.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.actor.colors import Samples, colored, colors_of
from sogjax.actor.limb_colors import agreed_samples, limb_pairs_alike
from sogjax.io.files import write_json
from sogjax.io.frame_motions import ClipFacts, motions_of
from sogjax.io.frame_table import FramesRecord, FrameTable
from sogjax.io.npz_file import read_npz, save_npz
from sogjax.model.body import Body
from sogjax.model.limbs import limb_names
from sogjax.run.actors import Actors
from sogjax.run.adjust_colors import more_doubtful
from sogjax.run.clip_sides import colors_by_frame, mean_colors
from sogjax.run.clock import StageTimes
from sogjax.run.forward import track_forward
from sogjax.run.initial_pose import InitialPose
from sogjax.run.merge import merge_backward
from sogjax.run.setup import Setup, with_bodies
from sogjax.run.terminal import say

FOLDER, SHOWN, LAST = "recolored", "shown.npz", "made.json"
TRACKED = "the clip as it was tracked"
"""Source of the pose with which tracking begins again."""
OTHER = 0.08
"""Mean distance of the blobs' colours (sRGB, 0 to 1) from which on a limb shows others than the actor's."""


@dataclass(frozen=True)
class RecoloredActors(FramesRecord):
    """The frames, tracked again with the actors' new colours, if these doubt less."""

    shown: dict[str, Float[np.ndarray, "blob 3"]]
    """What the frames showed of the blobs of each actor (sRGB, 0 to 1), by name."""
    actors: Actors | None = None
    """In new colours; None: the old ones hold, and the frames are as they were."""

    def save(self, folder: Path) -> None:
        """Keep it in a run's folder; a note comes last."""
        (folder / FOLDER).mkdir(exist_ok=True)
        if self.actors is not None:
            self.actors.save(folder / FOLDER)
        save_npz(folder / FOLDER / self.file, self.table.arrays())
        save_npz(folder / FOLDER / SHOWN, self.shown)
        write_json(folder / FOLDER / LAST, {"made": self.actors is not None})

    @classmethod
    def load(cls, folder: Path) -> "RecoloredActors | None":
        """What was kept, if all of it was."""
        place = folder / FOLDER
        if not (place / LAST).is_file():
            return None
        table = FrameTable.from_arrays(read_npz(place / cls.file))
        return cls(table, read_npz(place / SHOWN), Actors.load(place))


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
    by_frame = colors_by_frame(setup.clip.recording, of_actors)
    shown = {body.name: mean_colors(body, by_frame[body.name], color_space) for body in setup.bodies}
    found = {body.name: recolored(body, by_frame[body.name], color_space) for body in setup.bodies}
    told = [f"{name}: {listed}" for name, (_, listed) in found.items() if listed]
    if not told:
        return RecoloredActors(tracked, shown)
    say(f"tracked again with the colours that limbs show where they were tracked ({'; '.join(told)})")
    bodies = tuple(found[body.name][0] for body in setup.bodies)
    again, row = with_bodies(setup, bodies), surest_row(tracked)
    begin = InitialPose(setup.clip.numbers[row], np.asarray(tracked.pose[row]), TRACKED)
    table = track_forward(again, begin, StageTimes())
    table = merge_backward(again, table).table if both_ways else table
    if more_doubtful(table, tracked):
        say("the clip stays as it was, since limbs are more doubtful in the new colours")
        return RecoloredActors(tracked, shown)
    pairs = zip(actors.bodies, bodies, strict=True)
    named = tuple(colored(actor, np.asarray(body.blob_colors, float)) for actor, body in pairs)
    return RecoloredActors(table, shown, replace(actors, bodies=named))


def surest_row(table: FrameTable) -> int:
    """The row in which the limb that is most in doubt is least so; the first one where nothing is known of doubts."""
    return 0 if table.limb_doubt is None else int(np.argmin(np.max(table.limb_doubt, axis=1, initial=0.0)))


def recolored(body: Body, by_frame: Mapping[int, Samples], color_space: str) -> tuple[Body, str]:
    """A body whose limbs have the colours that frames show of them, if these are others; and which limbs these are.

    Pairs of limbs that are unlike in most frames keep theirs.
    """
    samples = [*by_frame.values()]
    shown = mean_colors(body, by_frame, color_space)
    agreed = agreed_samples(body, samples, shown)
    shown, own, names = colors_of(body, agreed.samples, color_space).colors, _colors(body), limb_names(body)
    unlike, taken = [pair.limbs for pair in agreed.unlike], list[str]()
    new = own.copy()
    for pair in limb_pairs_alike(body):
        off = max(np.linalg.norm(own[blobs] - shown[blobs], axis=1).mean() for blobs in pair.blobs)
        if off > OTHER and pair.limbs not in unlike:
            taken.append(" and ".join(names[k] for k in pair.limbs))
            for blobs in pair.blobs:
                new[blobs] = shown[blobs]
    return (colored(body, new), ", ".join(taken)) if taken else (body, "")


def _colors(body: Body) -> Float[np.ndarray, "blob 3"]:
    return np.asarray(body.blob_colors, float)
