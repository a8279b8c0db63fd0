"""Why an actor may be wrong: frames that do not suit it, limbs that they do not show, or that were not found."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.actor.limb_colors import UNLIKE, Pair
from sogjax.actor.posed_examples import overlap_of
from sogjax.actor.silhouettes import PosedPictures
from sogjax.model.body import Body
from sogjax.model.camera import Camera
from sogjax.model.limbs import limb_blobs, limb_names

LEAST_SHOWN = 0.7
"""Share of a limb's blobs that the masks must show."""
FRAMES_SUIT = 0.75
"""Mean IoU of frames that nobody chose below which the actor is doubtful: its limbs may be of the wrong sizes. Good
frames have 0.86 to 0.89, and 0.81 to 0.83 where masks say nothing of the legs; at 0.70 and 0.68 all was wrong."""


def doubt_of(body: Body, poses: Float[Array, "pose dof"], pictures: Sequence[PosedPictures], rig: Camera) -> str | None:
    """Why an actor of frames that nobody chose may be of the wrong sizes, with the remedy; None: they suited."""
    overlap = overlap_of(body, poses, pictures, rig)
    if overlap >= FRAMES_SUIT:
        return None
    shown = ", ".join(posed.name for posed in pictures)
    return (
        f"the actor is doubtful, and with it the motion: in the frames that suit best ({shown}) masks and body overlap "
        f"by only {overlap:.2f} (IoU; 0.8 and more is usual); name frames with an upright body and clear limbs in "
        "recording.yaml, such as `example_poses: [0, 150]`, or add example_poses/POSE/CAMERA.jpg with CAMERA.mask.png"
    )


def hardly_shown(body: Body, shown: Bool[np.ndarray, "blob"]) -> Bool[np.ndarray, "limb"]:
    """Of which limbs too little is among the blobs that some mask shows."""
    members = limb_blobs(body)
    return (members & shown).sum(axis=1) < LEAST_SHOWN * members.sum(axis=1)


def unseen_limbs(body: Body, shown: Bool[np.ndarray, "blob"], pictures: Sequence[PosedPictures]) -> str | None:
    """Of which limbs the pictures show too little, with the remedy; None: they show enough of all.

    `shown` are the blobs that some mask shows.
    """
    little = hardly_shown(body, shown)
    if not little.any():
        return None
    names = " and ".join(name for name, less in zip(limb_names(body), little, strict=True) if less)
    frames = ", ".join(posed.name for posed in pictures)
    return (
        f"the {names} of the actor may be anywhere: the frames that it is made of ({frames}) show less than "
        f"{LEAST_SHOWN:.0%} of them apart from the room; add pictures of the empty scene (background/CAMERA.jpg), or "
        "example_poses/POSE/CAMERA.jpg with CAMERA.mask.png, that show them"
    )


def unlike_sides(
    body: Body, colors: Float[np.ndarray, "blob 3"], unlike: Sequence[Pair], pictures: Sequence[PosedPictures]
) -> str | None:
    """Of which pairs of limbs of unlike `colors` (sRGB) one was not found; None: of none."""
    names = limb_names(body)
    said = [f"{' or '.join(names[k] for k in pair.limbs)} ({pair.apart(colors):.2f} apart)" for pair in unlike]
    if not said:
        return None
    frames = ", ".join(posed.name for posed in pictures)
    return (
        f"the {', and the '.join(said)} of the actor was not found in the frames that it is made of ({frames}), unless "
        f"clothes differ: left and right have other colours ({UNLIKE:g} and less is usual); name frames with clear "
        "limbs in recording.yaml, such as `example_poses: [0, 150]`"
    )
