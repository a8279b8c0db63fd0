"""Poses from angles with everyday names, and limbs that reach for a place (two-bone inverse kinematics)."""

from collections.abc import Mapping

import numpy as np

from sogjax.synth.anatomy import INDEX, JOINTS, PARENTS, SIDES, Anatomy, Pose
from sogjax.synth.rotations import Matrix, Vector, about, frame, mirrored, turned, unit


def pose_from_angles(angles: Mapping[str, float], position: Vector, heading: Matrix | None = None) -> Pose:
    """A pose from angles in degrees; what is not named is zero, i.e. upright with hanging arms.

    Trunk: `bend` (forwards), `lean` (to the left), `turn` (to the left), shared by three joints of the spine;
    `nod`, `tilt`, `look` the same for neck and head. With `left_` or `right_` in front: `raise` of the upper
    arm from hanging (0) over horizontal (90) to upright (180), in the vertical plane `plane` (0 = forwards,
    90 = sideways, negative = across the body); `roll` of the upper arm outwards about itself; `elbow` flexion;
    `palm` turned from facing the thigh forwards; `wrist` bent towards the back of the hand; and for the leg
    `hip` flexion, `spread` outwards, `knee` flexion, `ankle` (toes up).
    """
    get = lambda name: float(angles.get(name, 0.0))
    rotations = np.tile(np.eye(3), (len(JOINTS), 1, 1))
    rotations[0] = np.eye(3) if heading is None else heading
    spine = turned(("z", get("turn") / 3), ("y", get("bend") / 3), ("x", -get("lean") / 3))
    head = turned(("z", get("look") / 2), ("y", get("nod") / 2), ("x", -get("tilt") / 2))
    for names, rotation in ((("spine", "waist", "chest"), spine), (("neck", "head"), head)):
        for name in names:
            rotations[INDEX[name]] = rotation
    for side in SIDES:
        named = {key.removeprefix(f"{side}_"): value for key, value in angles.items()}
        for joint, rotation in {**_arm(named), **_leg(named)}.items():
            rotations[INDEX[f"{side}_{joint}"]] = rotation if side == "left" else mirrored(rotation)
    return Pose(np.asarray(position, float), rotations)


def _arm(angles: Mapping[str, float]) -> dict[str, Matrix]:
    """Rotations of a left arm; the shoulder girdle rises with the arm, which still points where it should."""
    get = lambda name: float(angles.get(name, 0.0))
    raised, plane = get("raise"), get("plane")
    share = np.clip((raised - 30.0) / 150.0, 0.0, 1.0)
    clavicle = turned(("x", float(28.0 * share * share * (3.0 - 2.0 * share))))
    upper_arm = turned(("z", plane), ("y", -raised), ("z", get("roll") - plane))
    return {
        "clavicle": clavicle,
        "shoulder": clavicle.T @ upper_arm,
        "elbow": turned(("y", -get("elbow"))),
        "wrist": turned(("z", get("palm")), ("x", get("wrist"))),
    }


def _leg(angles: Mapping[str, float]) -> dict[str, Matrix]:
    get = lambda name: float(angles.get(name, 0.0))
    return {
        "hip": turned(("x", get("spread")), ("y", -get("hip")), ("z", get("toes_out"))),
        "knee": turned(("y", get("knee"))),
        "ankle": turned(("y", -get("ankle"))),
        "toe": np.eye(3),
    }


def arm(side: str) -> tuple[str, str, str]:
    """The joints of an arm that reaches: root, middle and end."""
    return f"{side}_shoulder", f"{side}_elbow", f"{side}_wrist"


def leg(side: str) -> tuple[str, str, str]:
    """The joints of a leg that reaches: root, middle and end."""
    return f"{side}_hip", f"{side}_knee", f"{side}_ankle"


def reach(
    anatomy: Anatomy,
    pose: Pose,
    limb: tuple[str, str, str],
    target: Vector,
    pole: Vector,
    end: Matrix | None = None,
) -> Pose:
    """The pose with a limb bent so that its end lies at `target` (world), as far as it is long enough.

    `limb` names root, middle and end joint; the middle one bends towards `pole` (a direction in the world).
    `end` is the end joint's world rotation; without it the end keeps its angle to the limb.
    """
    frames = anatomy.world_from_joint(pose)
    root_joint, middle_joint, end_joint = limb
    root = frames[INDEX[root_joint], :3, 3]
    upper, lower = anatomy.length(middle_joint), anatomy.length(end_joint)
    middle, tip = _bend(root, np.asarray(target, float), upper, lower, pole)
    forwards = pole if root_joint.endswith("hip") else -pole
    upper_rotation = frame(root - middle, forwards)
    lower_rotation = frame(middle - tip, forwards)
    above = frames[PARENTS[INDEX[root_joint]], :3, :3]
    pose = pose.with_rotation(root_joint, above.T @ upper_rotation)
    pose = pose.with_rotation(middle_joint, upper_rotation.T @ lower_rotation)
    return pose if end is None else pose.with_rotation(end_joint, lower_rotation.T @ end)


def _bend(root: Vector, target: Vector, upper: float, lower: float, pole: Vector) -> tuple[Vector, Vector]:
    """Middle and end of two bones from `root` towards `target`, bent towards `pole`, never quite straight."""
    direction = unit(target - root)
    longest, shortest = 0.999 * (upper + lower), abs(upper - lower) + 0.05
    distance = float(np.clip(np.linalg.norm(target - root), shortest, longest))
    along = (upper**2 - lower**2 + distance**2) / (2.0 * distance)
    aside = np.sqrt(max(upper**2 - along**2, 0.0))
    sideways = unit(pole - (pole @ direction) * direction)
    return root + along * direction + aside * sideways, root + distance * direction


def heading_matrix(heading: float) -> Matrix:
    """The rotation of an upright body that faces `heading` (radians about the vertical, 0 = along x)."""
    return about("z", heading)
