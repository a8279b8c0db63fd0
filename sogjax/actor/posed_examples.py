"""Where the subject of each example pose is: rough poses by silhouettes, and which of them were found well."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Array, Float

from sogjax.actor.colors import ColoredView, camera_of
from sogjax.actor.coverage import silhouette_iou
from sogjax.actor.example_pose import consistent_ways, poses_from_silhouettes, side_colors, starts_at
from sogjax.actor.silhouettes import COARSE_DEPTH, PosedPictures, silhouette_views, subject_centre
from sogjax.energy.term import Terms
from sogjax.io.example_poses import ExamplePose
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.model.camera import Camera
from sogjax.search.rough_pose import rough_pose

Report = Callable[[str], None]
Progress = Callable[[Iterable[Any], int, str], Iterable[Any]]
"""Wraps items, of which there are so many, to show the progress under a label."""

AS_GOOD = 0.88
"""Share of the best one's IoU that another frame must reach, before the body is fitted. A pose that was not found
spoils the shape for all: a cartwheel's frames were at 0.65 to 0.71 where those upright were at 0.79 and 0.84."""


def rough_poses(
    recording: Recording,
    body: Body,
    shown: Sequence[tuple[ExamplePose, PosedPictures]],
    rig: Camera,
    terms: Terms,
    report: Report,
    progress: Progress,
) -> list[Float[Array, "dof"]]:
    """The rough poses of an upright body in the example pictures; front and back are told apart by all together."""
    coarse = silhouette_views([posed for _, posed in shown], rig, body.num_blobs, COARSE_DEPTH)
    ways, colors = [], []
    triples = [(*pair, views) for pair, views in zip(shown, coarse, strict=True)]
    for example, posed, views in progress(triples, len(triples), "example poses"):
        report(f"pose of {example.name}")
        starts = _starts(body, example, posed, rig, recording.up)
        ways.append(poses_from_silhouettes(body, views, starts, terms, recording.up))
        colors.append([side_colors(body, colored_views(posed, rig, way.pose), recording.up) for way in ways[-1]])
    chosen = consistent_ways([[way.energy for way in of_example] for of_example in ways], colors)
    return [of_example[k].pose for of_example, k in zip(ways, chosen, strict=True)]


def found_best(
    body: Body, poses: Sequence[Float[Array, "dof"]], pictures: Sequence[PosedPictures], rig: Camera, count: int
) -> list[int]:
    """The examples whose masks and silhouettes agree best in most cameras, none much worse than the best."""
    most = max(len(posed.masks) for posed in pictures)
    pairs = zip(poses, pictures, strict=True)
    worth = [agreement(body, pose, posed, rig) * len(posed.masks) / most for pose, posed in pairs]
    likely = [k for k in np.argsort(worth)[::-1][:count].tolist() if worth[k] >= AS_GOOD * max(worth)]
    return sorted(likely if len(likely) >= 2 else np.argsort(worth)[::-1][:2].tolist())


def colored_views(posed: PosedPictures, rig: Camera, pose: Float[Array, "dof"]) -> list[ColoredView]:
    """The pictures of an example pose with what they show."""
    return [ColoredView(camera_of(rig, k), image, posed.masks[k], pose) for k, image in posed.images.items()]


def agreement(body: Body, pose: Float[Array, "dof"], posed: PosedPictures, rig: Camera) -> float:
    """How well the body's silhouettes and the masks agree (IoU, mean over the cameras)."""
    return float(np.mean([silhouette_iou(body, pose, camera_of(rig, k), mask) for k, mask in posed.masks.items()]))


def _starts(
    body: Body, example: ExamplePose, pictures: PosedPictures, rig: Camera, up: str
) -> Float[Array, "heading named dof"]:
    """Where to look for the pose of one example: at its hint where there is one, else anywhere."""
    if example.initial_pose is not None:
        return rough_pose(body, example.initial_pose, up)[None, None]
    return starts_at(body, subject_centre(pictures, rig), up, tuple(body.poses))
