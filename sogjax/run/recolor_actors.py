"""Actors whose doubtful limbs are recoloured from the clip, which is tracked again with them.

An arm that was not found in the frames that its actor is made of has the colours of what was seen in its place. Over
the clip it was mostly found; its colours come from the frames in which left and right agree.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sogjax.actor.colors import Samples, colored, colors_of, joined_samples
from sogjax.actor.limb_colors import LEAST_SEEN, agreed_samples, limb_pairs_alike
from sogjax.errors import InputError
from sogjax.io.files import write_json
from sogjax.io.frame_motions import ClipFacts, motions_of
from sogjax.io.frame_table import FramesRecord, FrameTable
from sogjax.io.motion import Motion
from sogjax.io.npz_file import read_npz, save_npz
from sogjax.model.body import Body
from sogjax.model.limbs import limb_names
from sogjax.quality.limb_warnings import HIDDEN, in_doubt
from sogjax.run.actors import Actors
from sogjax.run.adjust_colors import more_doubtful
from sogjax.run.clip_sides import Masks, colors_by_frame
from sogjax.run.clock import StageTimes
from sogjax.run.forward import track_forward
from sogjax.run.initial_pose import InitialPose
from sogjax.run.merge import merge_backward
from sogjax.run.setup import Setup
from sogjax.run.terminal import say

FOLDER, LAST = "recolored", "made.json"
OFTEN = 0.05
"""Part of the frames in which a limb must be in doubt: less is not worth tracking a clip again."""
MORE_ALIKE = 0.5
"""Part of how far the actor's left and right are apart from which on those of the clip are far more alike."""
TRACKED = "the clip as it was tracked"
"""Source of the pose with which tracking begins again."""
OTHER = 0.08
"""Mean distance of the blobs' colours (sRGB, 0 to 1) from which on a limb shows others than the actor's."""


@dataclass(frozen=True)
class RecoloredActors(FramesRecord):
    """The frames, tracked again with the actors' new colours, unless limbs are more doubtful then."""

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
    setup: Setup,
    actors: Actors,
    tracked: FrameTable,
    color_space: str,
    setup_with: Callable[[Actors], Setup],
    both_ways: bool,
) -> RecoloredActors:
    """The clip tracked again with limbs in the colours that they show in it, where these are others than the actors'.

    Where a pass fails, the frames are as they were, which is said.

    Args:
        setup: what was tracked with.
        actors: of it, each in its own upright frame.
        tracked: the frames.
        color_space: in which colours are averaged.
        setup_with: makes the setup of other actors.
        both_ways: whether limbs are searched over the clip then, as before.
    """
    motions = motions_of(tracked, setup.bodies, ClipFacts.of(setup.clip.recording))
    said = dict(zip(motions, actors.unlike, strict=False))
    of_actors = {body.name: (body, motions[body.name]) for body in setup.bodies}
    named = {name: named_limbs(*of_actor, said.get(name, "")) for name, of_actor in of_actors.items()}
    if not any(named.values()):
        return RecoloredActors(tracked)
    try:
        shown = colors_by_frame(setup.clip.recording, of_actors, free_of_things(setup))
        new, told = _in_new_colors(setup.bodies, actors, named, shown, color_space)
        if not told:
            return RecoloredActors(tracked)
        say(f"tracking again, since limbs have other colours in the clip than the actors have ({'; '.join(told)})")
        again, row = setup_with(new), surest_row(tracked)
        begin = InitialPose(setup.clip.numbers[row], np.asarray(tracked.pose[row]), TRACKED)
        table = track_forward(again, begin, StageTimes(), again=True)
        table = merge_backward(again, table, tracked.pose).table if both_ways else table
    except InputError as error:
        say(f"warning: limbs keep the actors' colours: {error}")
        return RecoloredActors(tracked)
    if more_doubtful(table, tracked):
        say("the clip stays as it was, since limbs are more doubtful in the new colours")
        return RecoloredActors(tracked)
    return RecoloredActors(table, new)


def named_limbs(body: Body, motion: Motion, unlike: str) -> set[str]:
    """The limbs with a counterpart that often look doubtful, where nothing hides them, or are said to be `unlike`."""
    names = limb_names(body)
    if motion.limb_unlike is not None:
        motion = replace(motion, limb_doubt=motion.limb_unlike, limb_rival=None)
    doubted = in_doubt(motion) if motion.limb_doubt is not None else np.zeros((1, len(names)), bool)
    if motion.limb_hidden is not None:
        doubted &= motion.limb_hidden <= HIDDEN
    often = np.mean(doubted, axis=0) >= OFTEN
    paired = [k for pair in limb_pairs_alike(body) for k in pair.limbs]
    return {names[k] for k in paired if often[k] or names[k] in unlike}


def free_of_things(setup: Setup) -> Masks | None:
    """Where nothing stands in front, in the pictures of each camera; None: nothing does anywhere."""
    occluders = setup.tracker.reader.occluders
    if occluders is None:
        return None
    free = np.isinf(np.asarray(occluders.cells))
    return [grid.enlarged(free[k, : grid.rows, : grid.columns]) for k, grid in enumerate(setup.clip.grids)]


def surest_row(table: FrameTable) -> int:
    """The row in which the limb that is most in doubt is least so; the first one where nothing is known of doubts."""
    return 0 if table.limb_doubt is None else int(np.argmin(np.max(table.limb_doubt, axis=1, initial=0.0)))


def _in_new_colors(
    bodies: Sequence[Body],
    actors: Actors,
    named: Mapping[str, set[str]],
    shown: Mapping[str, Mapping[int, Samples]],
    color_space: str,
) -> tuple[Actors, list[str]]:
    """The actors in the colours that their named limbs show, and what to say of them."""
    new, told = list[Body](), list[str]()
    for body, actor in zip(bodies, actors.bodies, strict=True):
        other, taken = recolored(body, named[body.name], shown[body.name], color_space)
        new.append(colored(actor, np.asarray(other.blob_colors, float)) if taken else actor)
        told += [f"{body.name}: {', '.join(taken)}"] if taken else []
    return replace(actors, bodies=tuple(new)), told


def recolored(body: Body, named: set[str], by_frame: Mapping[int, Samples], color_space: str) -> tuple[Body, list[str]]:
    """A body whose named limbs have the colours that frames show of them, if these are others; and which these are.

    A limb goes with its counterpart. Pairs that are unlike in most frames keep theirs, unless they are far less so than
    in the actor, and so do those that are hardly seen.
    """
    samples = [*by_frame.values()]
    agreed = agreed_samples(body, samples, colors_of(body, joined_samples(samples), color_space).colors)
    shown, own = colors_of(body, agreed.samples, color_space), np.asarray(body.blob_colors, float)
    new, names, taken = own.copy(), limb_names(body), list[str]()
    for pair in limb_pairs_alike(body):
        both = [names[k] for k in pair.limbs]
        off = max(np.linalg.norm(own[blobs] - shown.colors[blobs], axis=1).mean() for blobs in pair.blobs)
        seen = min(shown.shown[blobs].mean() for blobs in pair.blobs) >= LEAST_SEEN
        alike = pair.limbs not in [each.limbs for each in agreed.unlike]
        alike |= pair.apart(shown.colors) < MORE_ALIKE * pair.apart(own)
        if off > OTHER and seen and alike and named.intersection(both):
            taken.append(" and ".join(both))
            for blobs in pair.blobs:
                new[blobs] = shown.colors[blobs]
    return (colored(body, new) if taken else body), taken
