"""Actors whose example poses are fitted again together: each to what the bodies of the others leave of all masks.

Where people reach for each other, no border between them tells whose an arm is, but bodies that are roughly known do.
So masks are not cut, and cameras in which one hides the other tell of both.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from sogjax.actor.body_silhouettes import WaysRound, upright_all_round
from sogjax.actor.coverage import body_silhouette
from sogjax.actor.facing import Way, consistent_ways, forward
from sogjax.actor.limb_silhouettes import Everybody, PoseAndMiss, with_limbs_found
from sogjax.actor.make import MadeActor, Making
from sogjax.actor.silhouette_fit import COARSE_CELLS, fit_edges, silhouettes_of
from sogjax.actor.silhouettes import PosedPictures
from sogjax.model.body import Body
from sogjax.model.camera import camera_of
from sogjax.model.cores import in_threads
from sogjax.scene.background_difference import reduced_mask, widened
from sogjax.scene.coarse_views import enlarged

AROUND = 2
"""Pixels of a mask at the working size around a body that are its own, too: sizes are only roughly known."""
LEAST_LEFT = 0.2
"""Share of somebody's silhouettes, the median of the cameras, that others must leave in one for it to tell."""
LEAST_GAINS = 0.15, 0.05
"""Part of its mismatch by which another way to see somebody must be better in each round: much at first, as limbs that
are found anew are not always better; less once poses of the other examples are the starts."""
LEAST_FIT = 1e-3
"""Of a way to see somebody, where he covers less than nothing of what is left of masks."""
FEWEST_CAMERAS = 2
"""Cameras that must tell of somebody in a pose."""

Poses = dict[str, Float[np.ndarray, "dof"]]


def made_together(
    makings: Sequence[Making], made: Sequence[MadeActor], shown: Mapping[str, PosedPictures]
) -> list[MadeActor]:
    """The actors, each made alone before, fitted again where all others are roughly known.

    `shown` are the masks of all people of such an example pose, by its name. Others keep their own masks.
    """
    poses: list[Poses] = [
        {name: np.asarray(pose) for name, pose in (actor.rough_poses | actor.example_poses).items()} for actor in made
    ]
    shared = [name for name in shown if all(name in of_actor for of_actor in poses)]
    if not shared:
        return list(made)
    people = People(tuple(made), {name: shown[name] for name in shared})
    for turn in range(len(LEAST_GAINS)):
        for k, making in enumerate(makings):
            poses[k] |= _searched(people, k, making, poses, turn)
    return in_threads(lambda k: people.fitted_again(k, makings[k], poses), range(len(made)))


def _searched(people: "People", k: int, making: Making, poses: Sequence[Poses], turn: int) -> Poses:
    """The poses of one of the actors in all shared examples, searched given those of the others.

    Also in those that it is not made of: the others are.
    """
    described, of_actor = making.described, {posed.name: posed for posed in people.made[k].pictures}
    own = [of_actor.get(name, everybodys) for name, everybodys in people.shown.items()]
    up = making.recording.up
    found = lambda posed: people.ways(k, posed, poses, turn, None if posed.name in described else up)
    ways = [*map(found, own[:1]), *in_threads(found, own[1:])]  # the first one compiles
    return believed(making, people.made[k].upright_body, dict(zip(people.shown, ways, strict=True)), turn)


def believed(making: Making, body: Body, ways: Mapping[str, Sequence[PoseAndMiss]], turn: int) -> Poses:
    """Of each shared example pose of an actor the way to see it, given with its mismatch, that goes with the others.

    A pose that is not the one until now, the first, must be better by the turn's `LEAST_GAINS` beside that.
    """
    fit = lambda number, miss: max(1.0 - miss / (1.0 - LEAST_GAINS[turn] * (number > 0)), LEAST_FIT)
    up, frames = making.recording.up, {example.name: example.frame for example in making.examples}
    facing = iter(forward(body, [pose for both in ways.values() for pose, _ in both], up))
    moments = [
        [Way(fit(number, miss), next(facing)) for number, (_, miss) in enumerate(both)] for both in ways.values()
    ]
    chosen = consistent_ways(moments, making.recording.times_of([frames[name] for name in ways]))
    return {name: both[k][0] for (name, both), k in zip(ways.items(), chosen, strict=True)}


@dataclass(frozen=True)
class People:
    """Some actors, and the masks of all of them in example poses, by name."""

    made: tuple[MadeActor, ...]
    shown: Mapping[str, PosedPictures]

    @cached_property
    def everybody(self) -> Everybody:
        """Their bodies as one."""
        return Everybody.of([actor.upright_body for actor in self.made])

    def ways(
        self, k: int, posed: PosedPictures, poses: Sequence[Poses], turn: int, up: str | None = None
    ) -> list[PoseAndMiss]:
        """The pose of one of them in an example, its limbs found, given those of the others; or ways to see it.

        Where `up` names the vertical, other ways are looked for, too: in the first turn all around it, then from its
        poses in the other examples. `posed` are its own pictures, if it is made of them, or those of everybody; each
        `turn` draws other ways to hold limbs. The mismatch of a single pose is not computed, but 0.
        """
        now = [of_actor[posed.name] for of_actor in poses]
        left = self.left_by_others(k, posed, now)
        if left is self.shown[posed.name]:  # those of everybody, which others leave nothing of
            return [(now[k], 0.0)]
        cells = silhouettes_of([left], self.made[k].rig, COARSE_CELLS)
        search = (now, jax.tree.map(lambda leaf: leaf[0], cells), turn)
        if up is not None:
            return WaysRound(self.everybody, k, up).found(*search, self._starts(k, posed.name, poses[k], turn, up))
        return [(with_limbs_found(self.everybody, k, *search), 0.0)]

    def _starts(self, k: int, example: str, poses: Poses, turn: int, up: str) -> list[Float[np.ndarray, "dof"]]:
        """The poses that a climb begins with, beside the present one."""
        if turn == 0:
            return upright_all_round(self.made[k].upright_body, up)
        return [poses[name] for name in self.shown if name != example]

    def fitted_again(self, k: int, making: Making, poses: Sequence[Poses]) -> MadeActor:
        """One of the actors, its shape and poses fitted to what the others leave, where that agrees better with it.

        The others are where their limbs were found, whether their own fit is taken or not.
        """
        actor = self.made[k]
        pictures = [
            self.left_by_others(k, posed, [of_actor[posed.name] for of_actor in poses])
            if posed.name in self.shown
            else posed
            for posed in actor.pictures
        ]
        found = jnp.stack([jnp.asarray(poses[k][posed.name]) for posed in pictures])
        near = eqx.tree_at(lambda estimate: estimate.poses, actor.estimate, found)
        estimate = fit_edges(actor.shape_model, near, silhouettes_of(pictures, actor.rig))
        if making.overlap(pictures, estimate) <= making.overlap(pictures, actor.estimate):
            return actor
        return making.finished(pictures, estimate, actor.rough_poses, actor.unsuitable)

    def left_by_others(self, k: int, own: PosedPictures, poses: Sequence[Float[np.ndarray, "dof"]]) -> PosedPictures:
        """The masks of all people, which say nothing where the bodies of others than one of them are.

        `own` are the masks of that one in the same pictures, which are kept where the others leave too little.
        """
        shown, masks, untold, parts = self.shown[own.name], {}, {}, {}
        if len(shown.masks) < FEWEST_CAMERAS:
            return own
        for camera, mask in shown.masks.items():
            small = reduced_mask(mask)
            seen = [
                body_silhouette(each.upright_body, jnp.asarray(pose), camera_of(each.rig, camera), small.shape)
                for each, pose in zip(self.made, poses, strict=True)
            ]
            others = widened(np.any(seen[:k] + seen[k + 1 :], axis=0), AROUND)
            parts[camera] = float((seen[k] & ~others).sum()), float(seen[k].sum())
            covered = enlarged(others, mask.shape)
            masks[camera] = mask & ~covered
            untold[camera] = (shown.untold.get(camera, np.zeros_like(mask)) | covered) & ~masks[camera]
        usual = np.median([whole for _, whole in parts.values()])
        kept = [camera for camera, (left, _) in parts.items() if left > LEAST_LEFT * usual and masks[camera].any()]
        if len(kept) < FEWEST_CAMERAS:
            return own
        some = lambda of_cameras: {camera: of_cameras[camera] for camera in kept}
        return replace(shown, images=some(shown.images), masks=some(masks), untold=some(untold))
