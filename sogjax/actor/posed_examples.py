"""Where the subject of each example pose is: rough poses by silhouettes, which were found well, what they explain."""

from collections.abc import Callable, Sequence

import cv2
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, UInt8

from sogjax.actor.colors import ColoredView
from sogjax.actor.coverage import silhouette_iou
from sogjax.actor.example_pose import poses_from_silhouettes, starts_at
from sogjax.actor.facing import Way, consistent_ways, forward, side_colors
from sogjax.actor.silhouettes import PosedPictures, Progress, subject_centre
from sogjax.energy.posed import Posed
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.io.example_poses import ExamplePose
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.model.camera import Camera, camera_of
from sogjax.model.compiled import compiled_hastily
from sogjax.model.cores import go_on
from sogjax.quality.limb_confidence import frame_fit
from sogjax.quality.limb_evidence import LimbBlobs, blob_evidence
from sogjax.scene.foreground import subject_colors
from sogjax.search.described_pose import described_pose

Report = Callable[[str], None]

AS_GOOD = 0.88
"""Share of the best one's IoU that another frame must reach, before the body is fitted. A pose that was not found
spoils the shape for all: a cartwheel's frames were at 0.65 to 0.71 where those upright were at 0.79 and 0.84."""


def rough_poses(
    body: Body,
    shown: Sequence[tuple[ExamplePose, PosedPictures, Views, Views]],
    rig: Camera,
    recording: Recording,
    terms: Terms,
    report: Report,
    progress: Progress,
) -> list[list[Float[Array, "dof"]]]:
    """The rough poses of an upright body in the example pictures; front and back are told apart by all together.

    Of each example are `shown` its pictures (`rig` has all cameras) and its silhouettes, coarse and fine. Of each, the
    pose that is believed, and after it that of the body turned round, if it was looked for.
    """
    found, up = [], recording.up
    for example, posed, coarse, fine in progress(shown, len(shown), "example poses"):
        go_on()
        report(f"pose of {example.name}")
        starts = _starts(body, example, posed, rig, up)
        found.append(poses_from_silhouettes(body, coarse, fine, starts, terms, up))
    colors = lambda pose, posed: side_colors(body, colored_views(posed, rig, pose), up)
    facing = iter(forward(body, [way.pose for of_example in found for way in of_example], up))
    ways = [
        [Way(way.energy, next(facing), colors(way.pose, posed)) for way in of_example]
        for of_example, (_, posed, _, _) in zip(found, shown, strict=True)
    ]
    chosen = consistent_ways(ways, recording.times_of([example.frame for example, *_ in shown]))
    return [
        [of_example[k].pose, *(way.pose for way in of_example if way is not of_example[k])]
        for of_example, k in zip(found, chosen, strict=True)
    ]


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
    return float(np.mean([*camera_agreements(body, pose, posed, rig).values()]))


def overlap_of(body: Body, poses: Float[Array, "pose dof"], pictures: Sequence[PosedPictures], rig: Camera) -> float:
    """How well the body's silhouettes and all masks agree (mean IoU)."""
    return float(np.mean([agreement(body, pose, posed, rig) for pose, posed in zip(poses, pictures, strict=True)]))


def camera_agreements(body: Body, pose: Float[Array, "dof"], posed: PosedPictures, rig: Camera) -> dict[int, float]:
    """How well the body's silhouette and the mask agree (IoU) in each camera."""
    return {
        k: silhouette_iou(body, pose, camera_of(rig, k), mask, posed.untold.get(k)) for k, mask in posed.masks.items()
    }


def _starts(
    body: Body, example: ExamplePose, pictures: PosedPictures, rig: Camera, up: str
) -> Float[Array, "heading named dof"]:
    """Where to look for the pose of one example: at its hint where there is one, else anywhere."""
    if example.initial_pose is not None:
        return described_pose(body, example.initial_pose, up)[None, None]
    return starts_at(body, subject_centre(pictures, rig), up, tuple(body.poses))


ROWS = 160
"""Cells of a picture's height, about: colours are compared as tracking compares them."""


def explained_examples(
    body: Body, poses: Sequence[Float[Array, "dof"]], pictures: Sequence[PosedPictures], rig: Camera
) -> list[float]:
    """Part of the visible area that shows the actor's own colours, of each of its example poses.

    The actor stands upright in the recording's world; `rig` has all cameras.
    """
    return [
        _explained(body, jnp.asarray(pose), *_cells(posed, rig)) for pose, posed in zip(poses, pictures, strict=True)
    ]


def _cells(
    posed: PosedPictures, rig: Camera
) -> tuple[Camera, UInt8[np.ndarray, "camera rows columns 3"], Float[np.ndarray, "camera"], Bool[np.ndarray, "camera"]]:
    """The pictures of a pose (RGB) in cells, the sides of these in pixels, and which cameras have a picture."""
    columns, rows = np.asarray(rig.image_size, int).T
    sides = np.maximum(np.rint(rows / ROWS), 1).astype(int)
    cells = np.zeros((len(rows), int((-(-rows // sides)).max()), int((-(-columns // sides)).max()), 3), np.uint8)
    for k, image in posed.images.items():
        reduced = _averaged(image, int(sides[k]))
        cells[k, : reduced.shape[0], : reduced.shape[1]] = reduced[..., ::-1]
    present = np.isin(np.arange(len(rows)), list(posed.images))
    return rig, cells, sides.astype(np.float32), present


def _averaged(image: UInt8[np.ndarray, "_h _w 3"], side: int) -> UInt8[np.ndarray, "rows columns 3"]:
    height, width = image.shape[:2]
    rows, columns = -(-height // side), -(-width // side)
    whole = cv2.copyMakeBorder(image, 0, rows * side - height, 0, columns * side - width, cv2.BORDER_REPLICATE)
    return cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_AREA)  # pyright: ignore[reportReturnType]


def _explained(
    body: Body,
    pose: Float[Array, "dof"],
    rig: Camera,
    cells: UInt8[np.ndarray, "camera rows columns 3"],
    sides: Float[np.ndarray, "camera"],
    present: Bool[np.ndarray, "camera"],
) -> float:
    colors = subject_colors(np.asarray(body.blob_colors), np.asarray(body.blob_sigmas) ** 2)
    arrays = (jnp.asarray(part) for part in (cells, sides, present, colors.astype(np.float32)))
    return float(_fit(body, LimbBlobs.from_body(body), pose, rig, *arrays))


@compiled_hastily
def _fit(
    body: Body, limbs: LimbBlobs, pose: Array, rig: Camera, cells: Array, sides: Array, present: Array, colors: Array
) -> Float[Array, ""]:
    posed = Posed.from_pose(body, pose)
    evidence = blob_evidence(limbs, posed, rig, None, cells, sides, colors, present)
    return frame_fit(limbs, evidence, posed, rig, None).explained[0]
