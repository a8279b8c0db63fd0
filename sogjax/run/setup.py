"""What frames are tracked with: the clip, the actors as they stand in its world, and the tracker made for them."""

from collections.abc import Sequence
from dataclasses import dataclass

from sogjax.energy.term import Term
from sogjax.model.body import Body, concatenate
from sogjax.run import build
from sogjax.run.background import Background
from sogjax.run.clip import Clip
from sogjax.run.clip_keypoints import keypoint_terms
from sogjax.run.recordings import upright
from sogjax.scene.cells import stack_shape
from sogjax.settings.run import TrackConfig
from sogjax.tracking.capacity import compile_counts
from sogjax.tracking.tracker import Tracker


@dataclass(frozen=True)
class Setup:
    """What frames are tracked with."""

    clip: Clip
    bodies: tuple[Body, ...]
    """The actors, upright in the recording's world."""
    tracker: Tracker


def tracking_setup(
    clip: Clip, background: Background, actors: Sequence[Body], config: TrackConfig, terms: Sequence[Term] = ()
) -> Setup:
    """The setup for actors in their own upright frames; `terms` are added to those of the settings."""
    bodies = tuple(upright(actor, clip.recording) for actor in actors)
    body = concatenate(list(bodies))
    terms = (*terms, *keypoint_terms(clip.keypoints, body, config))
    return Setup(clip, bodies, build.tracker(clip, background, body, config, terms))


def compile_beforehand(setup: Setup) -> None:
    """Compile what the first frame needs, while other work goes on."""
    compile_counts(setup.tracker, (len(setup.clip.grids), *stack_shape(setup.clip.grids), 3))
