"""An actor from a recording's example poses: a named body, scaled to the subject and coloured."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.actor.colors import ColoredView, back_projected_colors, camera_of, colored
from sogjax.actor.estimate import Estimate, estimate_shape
from sogjax.actor.example_pose import pose_from_silhouettes, starts_at
from sogjax.actor.shape import ShapeModel
from sogjax.actor.silhouette_cells import silhouettes_of
from sogjax.actor.silhouette_iou import silhouette_iou
from sogjax.actor.silhouettes import (
    COARSE_DEPTH,
    FINE_DEPTH,
    PosedPictures,
    load_pictures,
    same_capacity,
    silhouette_views,
    stack_views,
    subject_centre,
)
from sogjax.data.recording import ExamplePose, Recording
from sogjax.energy.term import Terms
from sogjax.errors import InputError
from sogjax.model.body import Body
from sogjax.model.camera import Camera
from sogjax.model.frames import world_from_upright
from sogjax.tracking.initial_pose import rough_pose

Report = Callable[[str], None]
Progress = Callable[[Iterable[Any], int, str], Iterable[Any]]
"""Wraps items, of which there are so many, to show the progress under a label."""

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
    pictures: tuple[PosedPictures, ...]
    """Of the example poses, in their order."""
    shape_model: ShapeModel
    """How the shape parameters scale the upright starting body."""
    estimate: Estimate

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
        """The same without any pictures."""
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
) -> MadeActor:
    """Scale and colour a body after the example poses of one subject; `symmetric`: left and right alike.

    Raises:
        InputError: no example poses of the subject, or pictures without masks.
    """
    examples = examples_of(recording, subject)
    rig = jax.tree.map(jnp.asarray, recording.rig.cameras)
    turn = world_from_upright(recording.up)
    upright = body.rotated(jnp.asarray(turn, body.blob_sigmas.dtype))
    model = ShapeModel.from_body(upright, symmetric)
    pictures = [load_pictures(recording, e, report) for e in progress(examples, len(examples), "masks")]
    coarse = same_capacity([silhouette_views(posed, rig, body.num_blobs, COARSE_DEPTH) for posed in pictures])
    poses = []
    triples = list(zip(examples, pictures, coarse, strict=True))
    for example, posed, views in progress(triples, len(triples), "example poses"):
        report(f"pose of {example.name}")
        starts = _starts(upright, example, posed, rig, recording.up)
        poses.append(pose_from_silhouettes(upright, views, starts, terms)[0])
    report("shape")
    views = stack_views([silhouette_views(posed, rig, body.num_blobs, FINE_DEPTH) for posed in pictures])
    estimate = estimate_shape(model, jnp.stack(poses), views, silhouettes_of(pictures, rig), terms)
    shaped = model.shaped(estimate.shape_params)
    _check_fit(recording, shaped, estimate, pictures, rig)
    report("colours")
    shown = [
        ColoredView(camera_of(rig, camera), image, posed.masks[camera], pose)
        for posed, pose in zip(pictures, estimate.poses, strict=True)
        for camera, image in posed.images.items()
    ]
    actor = replace(colored(shaped, back_projected_colors(shaped, shown, color_space)), name=subject or body.name)
    return MadeActor(
        body=actor.rotated(jnp.asarray(turn.T, body.blob_sigmas.dtype)),
        start=body,
        upright_body=actor,
        example_poses={example.name: pose for example, pose in zip(examples, estimate.poses, strict=True)},
        pictures=tuple(pictures),
        shape_model=model,
        estimate=estimate,
    )


def _check_fit(
    recording: Recording, body: Body, estimate: Estimate, pictures: Sequence[PosedPictures], rig: Camera
) -> None:
    """Refuse a fit in which a pose was not found.

    Raises:
        InputError: the silhouettes of the body and the masks of an example pose hardly overlap.
    """
    for posed, pose in zip(pictures, estimate.poses, strict=True):
        overlap = float(np.mean([silhouette_iou(body, pose, camera_of(rig, k), m) for k, m in posed.masks.items()]))
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


def _starts(
    body: Body, example: ExamplePose, pictures: PosedPictures, rig: Camera, up: str
) -> Float[Array, "heading named dof"]:
    """Where to look for the pose of one example: at its hint where there is one, else anywhere."""
    if example.initial_pose is not None:
        return rough_pose(body, example.initial_pose, up)[None, None]
    return starts_at(body, subject_centre(pictures, rig), up, tuple(body.poses))
