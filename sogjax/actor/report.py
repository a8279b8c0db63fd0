"""How good an actor is: silhouettes against masks, bone lengths, and what the pictures did not determine."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from sogjax.actor.make import MadeActor
from sogjax.actor.posed_examples import camera_agreements
from sogjax.io.calibration.rig import CameraRig
from sogjax.model.bones import bone_lengths
from sogjax.quality.proportions import odd_sentence

UNDETERMINED = 0.95
"""A shape parameter whose deviation is above this share of what was expected without pictures."""
POORLY_SEEN_ANGLE, POORLY_SEEN_LENGTH = 0.35, 0.05
"""Radians and metres: deviation of a degree of freedom in the pose that shows it best."""
POOR_IOU = 0.75
"""Mean IoU of a pose below which the pose, or a mask, is likely to be wrong."""


@dataclass(frozen=True)
class BoneChange:
    """One bone, in metres."""

    name: str
    before: float
    after: float


@dataclass(frozen=True)
class ActorReport:
    """The figures of one actor."""

    name: str
    ious: dict[str, dict[str, float]]
    """Intersection over union by example pose and camera."""
    bones: tuple[BoneChange, ...]
    warnings: tuple[str, ...]
    """One sentence each."""
    notes: tuple[str, ...] = ()
    """Sentences about what is usual."""

    @property
    def mean_iou(self) -> float:
        """The mean over all poses and cameras."""
        return float(np.mean([value for cameras in self.ious.values() for value in cameras.values()]))

    def pose_iou(self, pose: str) -> float:
        """Mean over the cameras of a pose."""
        return float(np.mean([*self.ious[pose].values()]))

    def as_dict(self) -> dict[str, Any]:
        """What the JSON file holds; lengths in metres."""
        return {
            "name": self.name,
            "mean_iou": self.mean_iou,
            "iou": self.ious,
            "bones": [asdict(bone) for bone in self.bones],
            "warnings": list(self.warnings),
            "notes": list(self.notes),
        }


def actor_report(made: MadeActor, rig: CameraRig) -> ActorReport:
    """Compare the actor with its pictures."""
    ious = {
        posed.name: {
            rig.names[camera]: iou
            for camera, iou in camera_agreements(made.upright_body, pose, posed, rig.cameras).items()
        }
        for posed, pose in zip(made.pictures, made.example_poses.values(), strict=True)
    }
    before, after = bone_lengths(made.start), bone_lengths(made.body)
    bones = tuple(BoneChange(name, before[name], length) for name, length in after.items())
    warnings = (
        *made.doubtful,
        *(warning for posed in made.pictures for warning in posed.warnings),
        *_poor_silhouettes(ious),
        *([] if (odd := odd_sentence(made.body, made.start)) is None else [odd]),
        *_unusual_sizes(made),
        *_poorly_seen_dofs(made),
    )
    return ActorReport(made.body.name, ious, bones, warnings, _undetermined_sizes(made))


def _poor_silhouettes(ious: Mapping[str, Mapping[str, float]]) -> list[str]:
    means = {pose: float(np.mean([*cameras.values()])) for pose, cameras in ious.items()}
    return [
        f"example pose {pose!r}: the silhouettes overlap the masks by only {mean:.2f} (IoU); look at "
        "its picture in the report, and correct a mask or give the pose's `initial_pose` in recording.yaml"
        for pose, mean in means.items()
        if mean < POOR_IOU
    ]


def _undetermined_sizes(made: MadeActor) -> tuple[str, ...]:
    """One sentence for all of them, as most recordings have a few hidden or small parts."""
    rows = zip(made.shape_names, made.shape_deviations, made.shape_priors, strict=True)
    found = [
        f"{name} (by {deviation:.0%}, without pictures {prior:.0%})"
        for name, deviation, prior in rows
        if not deviation <= UNDETERMINED * prior
    ]
    kept = "were not determined by the pictures and stay near those of the starting body"
    return (f"some sizes {kept}; they are uncertain: {', '.join(found)}",) if found else ()


def _unusual_sizes(made: MadeActor) -> list[str]:
    if not (names := made.shape_model.unusual_names(made.estimate.shape_params)):
        return []
    return [
        f"{', '.join(names)}: beyond what bodies differ by; masks may hold shadows or things: look at their pictures "
        "in the report, and correct the masks or give pictures of the empty scene"
    ]


def _poorly_seen_dofs(made: MadeActor) -> list[str]:
    skeleton = made.body.skeleton
    best = np.min(np.nan_to_num(made.pose_deviations, nan=np.inf), axis=0)
    warnings = []
    for name, deviation, slide in zip(skeleton.dof_names, best, ~skeleton.turning, strict=True):
        if deviation > (POORLY_SEEN_LENGTH if slide else POORLY_SEEN_ANGLE):
            amount = f"{1000 * deviation:.0f} mm" if slide else f"{np.degrees(deviation):.0f} degrees"
            warnings.append(
                f"{name} was never seen well (uncertain by {amount} in the best pose): whatever it turns may be off; "
                "add an example pose in which it is bent or seen from the side"
            )
    return warnings
