"""What to draw of a motion: bones between distinct joints, left and right apart, in an actor's colours."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from sogjax.io.motion import Motion
from sogjax.quality.limb_warnings import in_doubt

LEFT, MIDDLE, RIGHT = 0, 1, 2

_PALETTE = np.array(
    [
        [[64, 156, 255], [255, 236, 140], [255, 96, 64]],
        [[40, 220, 190], [200, 255, 170], [240, 80, 220]],
        [[150, 120, 255], [220, 200, 255], [255, 170, 40]],
        [[120, 220, 60], [240, 240, 240], [255, 120, 170]],
    ],
    np.uint8,
)
"""RGB of left, middle and right for one actor after the other."""

_SURFACE = float(np.sqrt(2.0 * np.log(2.0)))
"""Sigmas from a blob's centre to where it alone is worth one half, which is where a body ends."""


@dataclass(frozen=True)
class Bones:
    """The lines of an actor that are drawn."""

    joints: Int[np.ndarray, "joint"]
    """The distinct joints."""
    tips: Int[np.ndarray, "tip"]
    """The blobs at whose far side the last bones end."""
    edges: Int[np.ndarray, "edge 2"]
    """Numbers of the two points of each line: joints first, then tips."""
    sides: Int[np.ndarray, "edge"]
    """LEFT, MIDDLE or RIGHT of each edge."""

    @property
    def held_by(self) -> Int[np.ndarray, "edge"]:
        """The motion's joint that each edge moves with: the farther one, or the one that a tip is fixed to."""
        last = np.where(self.edges[:, 1] < self.num_joints, self.edges[:, 1], self.edges[:, 0])
        return self.joints[last] if len(self.edges) else np.zeros(0, int)

    @property
    def num_joints(self) -> int:
        """How many of the points are joints."""
        return len(self.joints)

    def points(self, motion: Motion) -> Float[np.ndarray, "frame point 3"]:
        """Metres, world: the distinct joints, then the far sides of the tips."""
        joints = motion.world_from_joint[:, self.joints][..., :3, 3]
        centres, pointed = motion.blob_means[:, self.tips], self.edges[len(self.edges) - len(self.tips) :, 0]
        along = centres - joints[:, pointed]
        lengths = np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-6)
        beyond = _SURFACE * motion.blob_sigma[self.tips][:, None] / lengths
        return np.concatenate([joints, centres + beyond * along], axis=1).astype(np.float32)


def doubtful_edges(motion: Motion, bones: Bones) -> Bool[np.ndarray, "frame edge"]:
    """Whether each bone belongs to a limb that is in doubt."""
    doubt = in_doubt(motion)
    if motion.joint_limb is None or doubt.shape[1] == 0:
        return np.zeros((motion.num_frames, len(bones.edges)), bool)
    limb = motion.joint_limb[bones.held_by]
    return doubt[:, limb] & (limb >= 0)


def bones_from_motion(motion: Motion) -> Bones:
    """Every joint to its nearest ancestor at another place; the last ones also to where their farthest blob ends."""
    drawn_as = _drawn_as(motion)
    parents = np.asarray(motion.joint_parents, int)
    joints: list[int] = sorted({int(joint) for joint in drawn_as if joint >= 0})
    edges = [(int(drawn_as[parents[j]]), j) for j in joints if parents[j] >= 0 and drawn_as[parents[j]] >= 0]
    tips = _tips(motion, drawn_as, set(joints) - {parent for parent, _ in edges})
    number = {joint: k for k, joint in enumerate(joints)}
    pairs = [(number[a], number[b]) for a, b in edges]
    pairs += [(number[joint], len(joints) + k) for k, (joint, _) in enumerate(tips)]
    return Bones(
        joints=np.array(joints, int),
        tips=np.array([blob for _, blob in tips], int),
        edges=np.array(pairs, int).reshape(-1, 2),
        sides=sides_of(motion)[np.array([b for _, b in edges] + [joint for joint, _ in tips], int)],
    )


def sides_of(motion: Motion) -> Int[np.ndarray, "joint"]:
    """LEFT, MIDDLE or RIGHT of every joint, by its name."""
    return np.array([side_of(str(name)) for name in motion.joint_names], int)


def actor_palette(actor: int) -> UInt8[np.ndarray, "3 3"]:
    """RGB of an actor's left, middle and right; actors far down the list share colours."""
    return _PALETTE[actor % len(_PALETTE)]


def blob_palette(motion: Motion, actor: int) -> UInt8[np.ndarray, "blob 3"]:
    """RGB of an actor's blobs, by the side of their joint."""
    return actor_palette(actor)[sides_of(motion)[np.asarray(motion.blob_joint, int)]]


def side_of(name: str) -> int:
    """LEFT, MIDDLE or RIGHT, as a name says."""
    words = name.rsplit("/", 1)[-1].lower().replace("-", "_").replace(".", "_").split("_")
    if "left" in words or words[0] == "l" or words[-1] == "l":
        return LEFT
    if "right" in words or words[0] == "r" or words[-1] == "r":
        return RIGHT
    return MIDDLE


def _drawn_as(motion: Motion) -> Int[np.ndarray, "joint"]:
    """The topmost joint within 0.1 mm of each one in every frame; -1 for joints that only place the root in the world.

    A root's translations are joints of their own, some of which stay on the world's axes: nothing is drawn
    above the first joint that has a blob or more than one child.
    """
    parents = np.asarray(motion.joint_parents, int)
    origins = motion.world_from_joint[:, :, :3, 3]
    body = _body_joints(parents, np.asarray(motion.blob_joint, int))
    drawn_as = np.full(len(parents), -1)
    for j, parent in enumerate(parents):
        if body[j]:
            together = parent >= 0 and np.abs(origins[:, j] - origins[:, parent]).max() < 1e-4
            drawn_as[j] = drawn_as[parent] if together and drawn_as[parent] >= 0 else j
    return drawn_as


def _body_joints(parents: np.ndarray, blob_joint: np.ndarray) -> np.ndarray:
    """False for the chain of joints between the world and the first joint with a blob or several children."""
    body = np.zeros(len(parents), bool)
    children = np.bincount(parents[parents >= 0], minlength=len(parents))
    for j, parent in enumerate(parents):
        body[j] = (parent >= 0 and body[parent]) or children[j] != 1 or j in blob_joint
    return body


def _tips(motion: Motion, drawn_as: np.ndarray, last: set[int]) -> list[tuple[int, int]]:
    """The pairs (joint, farthest blob) of the last joints that have a blob farther away than 2 cm."""
    blob_as = drawn_as[np.asarray(motion.blob_joint, int)]
    tips = []
    for joint in sorted(last):
        blobs = np.flatnonzero(blob_as == joint)
        lengths = np.linalg.norm(motion.blob_means[0, blobs] - motion.world_from_joint[0, joint, :3, 3], axis=-1)
        if blobs.size and lengths.max() > 0.02:
            tips.append((int(joint), int(blobs[lengths.argmax()])))
    return tips
