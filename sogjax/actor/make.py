"""An actor from a recording's example poses: a named body, scaled to the subject and coloured."""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.actor.colors import all_samples, colored, colors_of, joined_samples
from sogjax.actor.doubts import doubt_of, hardly_shown, unlike_sides, unseen_limbs
from sogjax.actor.limb_colors import agreed_samples
from sogjax.actor.posed_examples import (
    Report,
    agreement,
    colored_views,
    explained_examples,
    found_best,
    overlap_of,
    rough_poses,
)
from sogjax.actor.silhouette_fit import Estimate, compile_estimate, estimate_shape, silhouettes_of
from sogjax.actor.silhouettes import (
    COARSE_DEPTH,
    PosedPictures,
    Progress,
    load_all_pictures,
    silently,
    silhouette_views,
    stack_views,
)
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.errors import InputError
from sogjax.io.example_poses import ExamplePose
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.model.camera import Camera
from sogjax.model.compiled import compiled_hastily
from sogjax.model.limbs import limbs
from sogjax.model.rotation import world_from_upright
from sogjax.model.shape import ShapeModel
from sogjax.search.search_energy import RestPrior

_shaped = compiled_hastily(ShapeModel.shaped)

UNDECIDED_REST = 0.1
"""Weight of being near the rest pose (`RestPrior`), in units of the masks' area, where masks say nothing of what is
unknown: a leg behind a table may be anywhere else."""
UNDECIDED_EDGES = 5.0
"""How many times as much as usual it then counts, beside the edges of masks, that limbs are near rest which hardly any
mask shows: legs that never moved are the room to masks, which draws them onto a table, where these say nothing."""
POSE_FOUND = 0.5
"""Least IoU of masks and silhouettes, the mean over the cameras. Good fits have 0.8 to 0.9."""


@dataclass(frozen=True)
class MadeActor:
    """An actor in its own upright frame, and the poses of the example pictures in the recording's world."""

    body: Body
    start: Body
    """The body it was made from."""
    upright_body: Body
    """The actor as it stands in the recording's world; what the example poses are poses of."""
    example_poses: dict[str, Float[Array, "dof"]]
    frames: dict[str, int]
    """The recording's number of each example pose that is a frame of the videos."""
    pictures: tuple[PosedPictures, ...]
    """The pictures of the example poses, in their order."""
    rig: Camera
    """The cameras of the pictures."""
    shape_model: ShapeModel
    """How the shape parameters scale the upright starting body."""
    estimate: Estimate
    rough_poses: dict[str, Float[Array, "dof"]] = field(default_factory=dict)
    """As the masks alone tell them, also of examples that it is not made of."""
    explained: dict[str, float] = field(default_factory=dict)
    """Part of the visible area that shows the actor's own colours, of each example pose."""
    unsuitable: str | None = None
    """Why the frames that were chosen for it may not suit it, with the remedy."""
    doubt: str | None = None
    """Why its sizes may be wrong, with the remedy."""
    unlike: str | None = None
    """Which limbs were not found in the example poses, since left and right show other colours, with the remedy."""

    def suitability(self, name: str) -> float:
        """How well the body suits an example pose, 0 to 1.

        Masks and silhouettes (IoU, mean over the cameras), times the part of the body that shows the actor's colours.
        """
        posed = next(posed for posed in self.pictures if posed.name == name)
        silhouettes = agreement(self.upright_body, self.example_poses[name], posed, self.rig)
        return silhouettes * self.explained.get(name, 1.0)

    @property
    def doubtful(self) -> tuple[str, ...]:
        """What is doubtful of it, one sentence each with the remedy."""
        return tuple(said for said in (self.doubt, self.unlike) if said is not None)

    @property
    def shape_names(self) -> tuple[str, ...]:
        """Names of the shape parameters."""
        return self.shape_model.names

    @property
    def shape_deviations(self) -> Float[np.ndarray, "shape"]:
        """Standard deviations of the shape parameters (logarithms of scale factors)."""
        return np.asarray(self.estimate.shape_deviations, float)

    @property
    def shape_priors(self) -> Float[np.ndarray, "shape"]:
        """Standard deviations of the shape parameters without any pictures."""
        return np.asarray(self.shape_model.spread, float)

    @property
    def pose_deviations(self) -> Float[np.ndarray, "pose dof"]:
        """Standard deviations of the example poses (radians, metres)."""
        return np.asarray(self.estimate.pose_deviations, float)


@dataclass(frozen=True)
class Making:
    """What an actor is made of and from."""

    recording: Recording
    start: Body
    subject: str | None
    color_space: str
    shape_model: ShapeModel
    rig: Camera
    best: int | None
    """How many of its example poses are used, those that are found best, where nobody chose them; None: all."""
    report: Report

    @classmethod
    def of(
        cls, recording: Recording, start: Body, subject: str | None, color_space: str, symmetric: bool, **more: Any
    ) -> "Making":
        """With the body upright in the recording's world; `symmetric`: left and right alike."""
        upright = start.rotated(jnp.asarray(world_from_upright(recording.up), start.blob_sigmas.dtype))
        rig, model = jax.tree.map(jnp.asarray, recording.rig.cameras), ShapeModel.from_body(upright, symmetric)
        return cls(recording, start, subject, color_space, model, rig, **more)

    def made(
        self,
        terms: Terms,
        pictures: list[PosedPictures],
        progress: Progress = silently,
    ) -> MadeActor:
        """The body scaled and coloured after the example poses of the subject, of which `pictures` are given.

        Raises:
            InputError: no example poses of the subject, or a pose that was not found.
        """
        recording, model, rig, best = self.recording, self.shape_model, self.rig, self.best
        examples = self.examples
        for posed in pictures:
            for warning in posed.warnings:
                self.report(f"warning: {warning}")
        if any(posed.undecided for posed in pictures):
            share = float(np.mean([posed.mask_share() for posed in pictures]))
            terms = (*terms, RestPrior(UNDECIDED_REST * share))
        found = _found_poses(model.body, model, examples, pictures, rig, recording, terms, best, self.report, progress)
        self.report("shape")
        estimate = _best_estimate(model, found, rig, terms, 1 if best is None else 2, self._rest_weights(found))
        body = _shaped(model, estimate.shape_params)
        _check_fit(recording, body, estimate, found.pictures, rig, unchosen=best is not None and self.subject is None)
        return self.finished(found.pictures, estimate, found.rough, self.unsuitable(found.pictures, estimate))

    def _rest_weights(self, found: "_FoundPoses") -> Float[np.ndarray, "dof"]:
        """How many times as much as usual being near rest counts, by degree of freedom: `UNDECIDED_EDGES`, or 1."""
        body, rig = self.shape_model.body, self.rig
        weights = np.ones(body.skeleton.num_dofs, np.float32)
        if any(posed.undecided for posed in found.pictures):
            pairs = zip(found.pictures, found.ways, strict=True)
            samples = [all_samples(body, colored_views(posed, rig, ways[0])) for posed, ways in pairs]
            shown = colors_of(body, joined_samples(samples), self.color_space).shown
            for limb, little in zip(limbs(body.skeleton), hardly_shown(body, shown), strict=True):
                weights[limb] = UNDECIDED_EDGES if little else 1.0
        return weights

    @property
    def examples(self) -> list[ExamplePose]:
        """The example poses of the subject."""
        return examples_of(self.recording, self.subject)

    @property
    def described(self) -> set[str]:
        """Those of which somebody, or keypoints, say roughly how the subject stands."""
        return {example.name for example in self.examples if example.initial_pose is not None}

    def overlap(self, pictures: Sequence[PosedPictures], estimate: Estimate) -> float:
        """How well the silhouettes of an estimate and all masks agree (mean IoU)."""
        return overlap_of(_shaped(self.shape_model, estimate.shape_params), estimate.poses, pictures, self.rig)

    def unsuitable(self, pictures: Sequence[PosedPictures], estimate: Estimate) -> str | None:
        """Why frames that were chosen do not suit, with the remedy; None: they do, or somebody chose them."""
        shaped = _shaped(self.shape_model, estimate.shape_params)
        return doubt_of(shaped, estimate.poses, pictures, self.rig) if self.best is not None else None

    def finished(
        self,
        pictures: Sequence[PosedPictures],
        estimate: Estimate,
        rough: Mapping[str, Float[Array, "dof"]],
        unsuitable: str | None,
    ) -> MadeActor:
        """The actor of an estimate, in the colours that the pictures of its poses show, and what is doubtful of it."""
        self.report("colours")
        shaped, rig = _shaped(self.shape_model, estimate.shape_params), self.rig
        pairs = zip(pictures, estimate.poses, strict=True)
        samples = [all_samples(shaped, colored_views(posed, rig, pose)) for posed, pose in pairs]
        found = colors_of(shaped, joined_samples(samples), self.color_space)
        doubts, unlike = [unsuitable], None
        if any(posed.undecided for posed in pictures):
            doubts.append(unseen_limbs(shaped, found.shown, pictures))
        if self.best is not None:
            agreed = agreed_samples(shaped, samples, found.colors)
            unlike = unlike_sides(shaped, found.colors, agreed.unlike, pictures)
            found = colors_of(shaped, agreed.samples, self.color_space)
        actor = replace(colored(shaped, found.colors), name=self.subject or self.start.name)
        explained = explained_examples(actor, list(estimate.poses), pictures, rig)
        actor = replace(actor, explained=jnp.asarray(np.mean(explained), jnp.float32))
        names, turn = [posed.name for posed in pictures], world_from_upright(self.recording.up)
        frames = {example.name: example.frame for example in self.examples}
        return MadeActor(
            body=actor.rotated(jnp.asarray(turn.T, self.start.blob_sigmas.dtype)),
            start=self.start,
            upright_body=actor,
            example_poses=dict(zip(names, estimate.poses, strict=True)),
            frames={name: frame for name in names if (frame := frames[name]) is not None},
            pictures=tuple(pictures),
            rig=rig,
            shape_model=self.shape_model,
            estimate=estimate,
            rough_poses={**rough},
            explained=dict(zip(names, explained, strict=True)),
            unsuitable=unsuitable,
            doubt="; ".join(said for said in doubts if said is not None) or None,
            unlike=unlike,
        )


def make_actor(
    recording: Recording,
    body: Body,
    subject: str | None,
    color_space: str,
    terms: Terms,
    report: Report = lambda _: None,
    best: int | None = None,
) -> MadeActor:
    """Scale and colour a body after the example poses of one subject, left and right alike (`Making`).

    Of the example poses the `best` that are found best are used; None: all.

    Raises:
        InputError: no example poses of the subject, or pictures without masks.
    """
    making = Making.of(recording, body, subject, color_space, True, best=best, report=report)
    return making.made(terms, load_all_pictures(recording, making.examples))


class _FoundPoses(NamedTuple):
    """The example poses that an actor is made of, and the rough poses in them."""

    pictures: list[PosedPictures]
    views: list[Views]
    """The silhouettes."""
    ways: list[list[Float[Array, "dof"]]]
    """The pose of each that is believed, and after it that of the body turned round, if it was looked for."""
    rough: dict[str, Float[Array, "dof"]]
    """The pose that is believed of all examples, by name."""


def _found_poses(
    upright: Body,
    model: ShapeModel,
    examples: list[ExamplePose],
    pictures: list[PosedPictures],
    rig: Camera,
    recording: Recording,
    terms: Terms,
    best: int | None,
    report: Report,
    progress: Progress,
) -> _FoundPoses:
    """Rough poses of all examples, or of the `best` that are found best, if these are fewer."""
    views = silhouette_views(pictures, rig, upright.num_blobs)
    coarse = silhouette_views(pictures, rig, upright.num_blobs, COARSE_DEPTH)
    shown = list(zip(examples, pictures, coarse, views, strict=True))
    chooses = best is not None and len(examples) > best
    with ThreadPoolExecutor(1) as beside:
        if not chooses:
            beside.submit(compile_estimate, model, stack_views(views), silhouettes_of(pictures, rig), terms)
        ways = rough_poses(upright, shown, rig, recording, terms, report, progress)
    rough = {posed.name: poses[0] for posed, poses in zip(pictures, ways, strict=True)}
    found = _FoundPoses(pictures, views, ways, rough)
    if best is None or not chooses:
        return found
    kept = found_best(upright, [poses[0] for poses in ways], pictures, rig, best)
    report(f"uses {', '.join(examples[k].name for k in kept)}")
    some = lambda values: [values[k] for k in kept]
    return _FoundPoses(some(pictures), some(views), some(ways), rough)


def _best_estimate(
    model: ShapeModel,
    found: _FoundPoses,
    rig: Camera,
    terms: Terms,
    ways: int,
    rest_weights: Float[np.ndarray, "dof"],
) -> Estimate:
    """Poses and shape fitted to the silhouettes, in so many ways, if found: that which agrees best with the masks.

    Rough silhouettes hardly tell front from back; the fitted body does.
    """
    silhouettes, views = silhouettes_of(found.pictures, rig), stack_views(found.views)
    posed = lambda way: jnp.stack([poses[way] for poses in found.ways])
    estimates = [
        estimate_shape(model, posed(way), views, silhouettes, terms, rest_weights=rest_weights)
        for way in range(min(ways, *map(len, found.ways)))
    ]
    agrees = lambda estimate: overlap_of(_shaped(model, estimate.shape_params), estimate.poses, found.pictures, rig)
    return max(estimates, key=agrees) if len(estimates) > 1 else estimates[0]


def _check_fit(
    recording: Recording,
    body: Body,
    estimate: Estimate,
    pictures: Sequence[PosedPictures],
    rig: Camera,
    unchosen: bool,
) -> None:
    """Refuse a fit in which a pose was not found; `unchosen`: nobody chose the pictures of the only one.

    Raises:
        InputError: the silhouettes of the body and the masks of an example pose hardly overlap.
    """
    for posed, pose in zip(pictures, estimate.poses, strict=True):
        overlap = agreement(body, pose, posed, rig)
        if overlap < POSE_FOUND:
            several = "if several people are seen, say how many with actors=2 or more; else " if unchosen else ""
            raise InputError(
                f"{recording.path}: the pose of the example {posed.name!r} was not found: its masks and the body's "
                f"silhouettes overlap by only {overlap:.2f} (IoU); {several}look at the masks with `sogjax segment`, "
                f"or give its rough pose in recording.yaml, as `example_poses: [{{name: {posed.name}, initial_pose: "
                "{pose: ..., position: [x, y, z], heading: ...}}]`"
            )


def subjects_of(recording: Recording) -> tuple[str | None, ...]:
    """The subjects that the example poses show; (None,) where they name none."""
    names = dict.fromkeys(example.actor for example in recording.example_poses)
    return tuple(names) or (None,)


def examples_of(recording: Recording, subject: str | None) -> list[ExamplePose]:
    """The example poses of one subject.

    Raises:
        InputError: there are none, or several subjects and none is chosen.
    """
    if not recording.example_poses:
        raise InputError(
            f"{recording.path}: no example poses to make an actor from; add example_poses/POSE/CAMERA.jpg "
            "with CAMERA.mask.png, or give an actor file with actor=FILE"
        )
    subjects = subjects_of(recording)
    if subject is None and len(subjects) > 1:
        named = ", ".join(str(name) for name in subjects)
        raise InputError(f"{recording.path}: the example poses show {named}; choose one with subject=NAME")
    wanted = next(iter(subjects)) if subject is None else subject
    examples = [e for e in recording.example_poses if e.actor == wanted or (e.actor is None and len(subjects) == 1)]
    if not examples:
        named = ", ".join(str(name) for name in subjects)
        raise InputError(f"{recording.path}: no example poses of subject={subject}; they show {named}")
    return examples
