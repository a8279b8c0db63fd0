"""An actor from a recording's example poses: a named body, scaled to the subject and coloured."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.actor.colors import back_projected_colors, colored
from sogjax.actor.doubts import doubt_of, unlike_sides, unseen_limbs
from sogjax.actor.posed_examples import (
    Progress,
    Report,
    agreement,
    colored_views,
    explained_examples,
    found_best,
    overlap_of,
    rough_poses,
)
from sogjax.actor.silhouette_fit import Estimate, compile_estimate, estimate_shape, silhouettes_of
from sogjax.actor.silhouettes import COARSE_DEPTH, PosedPictures, load_pictures, silhouette_views, stack_views
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.errors import InputError
from sogjax.io.example_poses import ExamplePose
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.model.camera import Camera
from sogjax.model.compiled import compiled_hastily
from sogjax.model.rotation import world_from_upright
from sogjax.model.shape import ShapeModel
from sogjax.scene.background import BackgroundImage
from sogjax.search.search_energy import RestPrior

_shaped = compiled_hastily(ShapeModel.shaped)

UNDECIDED_REST = 0.03
"""Weight of being near the rest pose (`RestPrior`), in units of the masks' area, where masks say nothing of what is
unknown: a leg behind a table may be anywhere else."""
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
    doubt: str | None = None
    """Why its sizes may be wrong, with the remedy."""

    def agreement(self, name: str) -> float:
        """How well the masks of an example pose and the body's silhouettes agree (IoU, mean over the cameras)."""
        posed = next(posed for posed in self.pictures if posed.name == name)
        return agreement(self.upright_body, self.example_poses[name], posed, self.rig)

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


def make_actor(
    recording: Recording,
    body: Body,
    subject: str | None,
    color_space: str,
    terms: Terms,
    report: Report = lambda _: None,
    progress: Progress = lambda items, total, label: items,
    symmetric: bool = True,
    learnt: Sequence[BackgroundImage] | None = None,
    best: int | None = None,
) -> MadeActor:
    """Scale and colour a body after the example poses of one subject; `symmetric`: left and right alike.

    `learnt` is the background of every camera, for pictures that have neither masks nor pictures of the empty scene. Of
    the example poses the `best` that are found best are used; None: all.

    Raises:
        InputError: no example poses of the subject, or pictures without masks.
    """
    examples = examples_of(recording, subject)
    rig = jax.tree.map(jnp.asarray, recording.rig.cameras)
    turn = world_from_upright(recording.up)
    upright = body.rotated(jnp.asarray(turn, body.blob_sigmas.dtype))
    model = ShapeModel.from_body(upright, symmetric)
    pictures = [load_pictures(recording, e, report, learnt) for e in progress(examples, len(examples), "masks")]
    undecided = any(posed.undecided for posed in pictures)
    if undecided:
        terms = (*terms, RestPrior(UNDECIDED_REST * float(np.mean([posed.mask_share() for posed in pictures]))))
    found = _found_poses(upright, model, examples, pictures, rig, recording.up, terms, best, report, progress)
    examples, pictures = found.examples, found.pictures
    report("shape")
    estimate = _best_estimate(model, found, rig, terms, ways=1 if best is None else 2)
    shaped = _shaped(model, estimate.shape_params)
    _check_fit(recording, shaped, estimate, pictures, rig)
    report("colours")
    shown = [
        view for posed, pose in zip(pictures, estimate.poses, strict=True) for view in colored_views(posed, rig, pose)
    ]
    found_colors = back_projected_colors(shaped, shown, color_space)
    unsuitable = None if best is None else doubt_of(shaped, estimate.poses, pictures, rig)
    unseen = unseen_limbs(shaped, found_colors.shown, pictures) if undecided else None
    uneven = None if best is None else unlike_sides(shaped, np.asarray(found_colors.colors), pictures)
    doubt = "; ".join(said for said in (unsuitable, unseen, uneven) if said is not None) or None
    if doubt is not None:
        report(f"warning: {doubt}")
    actor = replace(colored(shaped, found_colors.colors), name=subject or body.name)
    explained = explained_examples(actor, list(estimate.poses), pictures, rig)
    actor = replace(actor, explained=jnp.asarray(explained, jnp.float32))
    return MadeActor(
        body=actor.rotated(jnp.asarray(turn.T, body.blob_sigmas.dtype)),
        start=body,
        upright_body=actor,
        example_poses={example.name: pose for example, pose in zip(examples, estimate.poses, strict=True)},
        frames={example.name: example.frame for example in examples if example.frame is not None},
        pictures=tuple(pictures),
        rig=rig,
        shape_model=model,
        estimate=estimate,
        doubt=doubt,
    )


class _FoundPoses(NamedTuple):
    """The example poses that an actor is made of, and the rough poses in them."""

    examples: list[ExamplePose]
    pictures: list[PosedPictures]
    views: list[Views]
    """The silhouettes."""
    ways: list[list[Float[Array, "dof"]]]
    """The pose of each that is believed, and after it that of the body turned round, if it was looked for."""


def _found_poses(
    upright: Body,
    model: ShapeModel,
    examples: list[ExamplePose],
    pictures: list[PosedPictures],
    rig: Camera,
    up: str,
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
        ways = rough_poses(upright, shown, rig, up, terms, report, progress)
    found = _FoundPoses(examples, pictures, views, ways)
    if best is None or not chooses:
        return found
    kept = found_best(upright, [poses[0] for poses in ways], pictures, rig, best)
    report(f"uses {', '.join(examples[k].name for k in kept)}")
    some = lambda values: [values[k] for k in kept]
    return _FoundPoses(some(examples), some(pictures), some(views), some(ways))


def _best_estimate(model: ShapeModel, found: _FoundPoses, rig: Camera, terms: Terms, ways: int) -> Estimate:
    """Poses and shape fitted to the silhouettes, in so many ways, if found: that which agrees best with the masks.

    Rough silhouettes hardly tell front from back; the fitted body does.
    """
    silhouettes, views = silhouettes_of(found.pictures, rig), stack_views(found.views)
    estimates = [
        estimate_shape(model, jnp.stack([poses[way] for poses in found.ways]), views, silhouettes, terms)
        for way in range(min(ways, *map(len, found.ways)))
    ]
    agrees = lambda estimate: overlap_of(_shaped(model, estimate.shape_params), estimate.poses, found.pictures, rig)
    return max(estimates, key=agrees) if len(estimates) > 1 else estimates[0]


def _check_fit(
    recording: Recording, body: Body, estimate: Estimate, pictures: Sequence[PosedPictures], rig: Camera
) -> None:
    """Refuse a fit in which a pose was not found.

    Raises:
        InputError: the silhouettes of the body and the masks of an example pose hardly overlap.
    """
    for posed, pose in zip(pictures, estimate.poses, strict=True):
        overlap = agreement(body, pose, posed, rig)
        if overlap < POSE_FOUND:
            raise InputError(
                f"{recording.path}: the pose of the example {posed.name!r} was not found: its masks and the body's "
                f"silhouettes overlap by only {overlap:.2f} (IoU); look at the masks with `sogjax segment`, or give "
                f"its rough pose in recording.yaml, as `example_poses: [{{name: {posed.name}, initial_pose: "
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
