"""Rendered people for tests: bodies, their motions, how near they come to each other and to themselves."""

from functools import cache

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from sogjax.synth.anatomy import INDEX, anatomy_from_seed
from sogjax.synth.clothes import outfits_from_seed
from sogjax.synth.figure import BONES, make_figure
from sogjax.synth.flesh import Flesh, flesh_of
from sogjax.synth.motions import motions_of

DIAGONAL = np.array([[1.0, -1.0, 0.0], [-1.0, -1.0, 0.0], [0.0, 0.0, -np.sqrt(2.0)]]) / np.sqrt(2.0)
"""Rows: the axes of the left shoulder's degrees of freedom in the human body's file."""
HAND = [BONES.index(f"{side}_wrist") for side in ("left", "right")]


@cache
def person(number):
    """One of four people of different size."""
    outfits = outfits_from_seed(np.random.default_rng(0), 4)
    return make_figure(anatomy_from_seed(np.random.default_rng(number)), outfits[number])


def people(count):
    """The first of them."""
    return [person(number) for number in range(count)]


@cache
def motions(kind, count=1, furnished=False):
    """The motions of the first people."""
    return motions_of(kind, [body.anatomy for body in people(count)], np.random.default_rng(1), furnished)


def flesh_in(body, pose, only=None):
    """The body as melted capsules in a pose, or one part of it; its `field` is negative inside."""
    lumps = flesh_of(body.anatomy, body.outfit.sleeve).lumps
    kept = tuple(lump for lump in lumps if only is None or lump.part == only)
    return Flesh(kept, body.anatomy.world_from_joint(pose))


def depth_of_others(bodies, poses):
    """Metres by which the skin of either of two people lies within the other one; negative: the gap."""
    skins = [body.posed(pose).vertices for body, pose in zip(bodies, poses, strict=True)]
    depths = []
    for body, pose, own, other in zip(bodies, poses, skins, skins[::-1], strict=True):
        away, _ = cKDTree(own).query(other)
        near = other[away < max(0.1, away.min() + 0.01)]
        depths.append(-flesh_in(body, pose).field(near).min())
    return max(depths)


def depth_of_hands_in_trunk(body, pose):
    """Metres by which the skin of the hands lies within the person's own trunk; negative: the gap."""
    distances = flesh_in(body, pose, "torso").distances(body.posed(pose).vertices[hands_of(body)])
    return -distances.min()


def hands_of(body):
    """The vertices that follow the wrists."""
    return np.flatnonzero(np.isin(np.argmax(body.weights, axis=1), HAND))


def human_angles(pose):
    """Degrees of freedom of the human body's file, in degrees, that come closest to a pose of the figure.

    Each joint's rotation is read about the axes that the body has there, in their order.
    """
    rotation = lambda name: Rotation.from_matrix(pose.rotations[INDEX[name]])
    bend, lean, twist = (rotation("spine") * rotation("waist") * rotation("chest")).as_euler("YXZ", degrees=True)
    angles = {"spine_bend": bend, "spine_lean": -lean, "spine_twist": twist}
    _, lean, twist = (rotation("neck") * rotation("head")).as_euler("YXZ", degrees=True)
    angles |= {"neck_lean": -lean, "neck_twist": twist}
    for side in ("left", "right"):
        mirror = np.diag([1.0, 1.0 if side == "left" else -1.0, 1.0])
        own = lambda joint, m=mirror, s=side: Rotation.from_matrix(m @ rotation(f"{s}_{joint}").as_matrix() @ m)
        shoulder = Rotation.from_matrix(DIAGONAL @ own("shoulder").as_matrix() @ DIAGONAL.T)
        raised, swing, roll = shoulder.as_euler("XYZ", degrees=True)
        hip_bend, hip_side, hip_twist = own("hip").as_euler("YXZ", degrees=True)
        roll_of_hand, wrist_bend, wrist_side = own("wrist").as_euler("ZXY", degrees=True)
        values = {
            "shoulder_raise": raised,
            "shoulder_swing": swing,
            "shoulder_roll": roll,
            "elbow": -own("elbow").as_euler("YXZ", degrees=True)[0],
            "forearm_roll": -roll_of_hand,
            "wrist_bend": -wrist_bend,
            "wrist_side": -wrist_side,
            "hip_bend": -hip_bend,
            "hip_side": hip_side,
            "hip_twist": -hip_twist,
            "knee": own("knee").as_euler("YXZ", degrees=True)[0],
            "ankle_bend": -own("ankle").as_euler("YXZ", degrees=True)[0],
        }
        angles |= {f"{side}_{name}": value for name, value in values.items()}
    return angles
