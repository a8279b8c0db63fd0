"""What is plotted of a motion: its joint angles in degrees, and how fast its ends move."""

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.export.angles import joint_angles
from sogjax.io.motion import Motion
from sogjax.model.body import Body
from sogjax.view.bones import LEFT, RIGHT, side_of
from sogjax.view.page.plots import Curves

SIDES = {"left": "left", "right": "right", "accent": "middle"}
"""Colours of the style, and whose they are."""
_TITLES = {"arm_flex": "shoulder flexion", "arm_add": "shoulder adduction", "arm_rot": "shoulder rotation"}
_TITLES |= {"pro_sup": "forearm pronation", "elbow_flex": "elbow flexion", "wrist_dev": "wrist deviation"}
_TITLES |= {"wrist_flex": "wrist flexion", "knee_angle": "knee flexion", "ankle_angle": "ankle dorsiflexion"}
_TITLES |= {"subtalar_angle": "subtalar inversion"}
_FIRST = ("hip_", "knee_", "ankle_", "subtalar_", "arm_", "elbow_", "pro_", "wrist_", "pelvis_", "lumbar_", "neck_")


def angle_panels(motion: Motion, body: Body) -> list[Curves]:
    """Joint angles in degrees, left and right in one panel; of other bodies than people their degrees of freedom."""
    try:
        found = {name: angle for name, angle in joint_angles(motion, motion.up).items() if "pelvis_t" not in name[:8]}
        tilt = joint_angles(motion, motion.up).get("pelvis_tilt")
        found |= {} if tilt is None else {"pelvis_tilt": tilt}
    except InputError:
        return _paired(_turning(motion, body))
    place = lambda name: next((k for k, start in enumerate(_FIRST) if name.startswith(start)), len(_FIRST))
    return _paired({name: found[name] for name in sorted(found, key=place)})


def _turning(motion: Motion, body: Body) -> dict[str, Float[np.ndarray, "frame"]]:
    """The degrees of freedom that turn, in degrees."""
    columns = zip(body.skeleton.dof_names, body.skeleton.turning, motion.pose.T, strict=True)
    return {name: np.degrees(np.asarray(values, float)) for name, turns, values in columns if turns}


def _paired(angles: dict[str, Float[np.ndarray, "frame"]]) -> list[Curves]:
    panels: dict[str, dict[str, np.ndarray]] = {}
    for name, values in angles.items():
        side = side_of(name)
        color = "left" if side == LEFT else "right" if side == RIGHT else "accent"
        title = _without_side(name)
        shown = np.unwrap(np.asarray(values, float), period=360.0)
        panels.setdefault(_TITLES.get(title, title.replace("_", " ")), {})[color] = shown
    return [Curves(title[:1].upper() + title[1:], "degrees", curves) for title, curves in panels.items()]


def _without_side(name: str) -> str:
    words = [word for word in name.rpartition("/")[2].split("_") if word not in ("left", "right")]
    return "_".join(words[:-1] if len(words) > 1 and words[-1] in ("l", "r") else words) or name


def speed_panels(motion: Motion) -> list[Curves]:
    """Speeds in m/s of the root and of the last joint of each limb, left and right in one panel."""
    parents = np.asarray(motion.joint_parents, int)
    body = [int(np.flatnonzero(motion.blob_joint == motion.blob_joint[0])[0])]
    root = int(motion.blob_joint[body[0]])
    while parents[root] >= 0 and parents[root] in motion.blob_joint:
        root = int(parents[root])
    places = {"root": root}
    if motion.joint_limb is not None and motion.limb_names is not None:
        for limb, name in enumerate(motion.limb_names.tolist()):
            joints = np.flatnonzero(np.asarray(motion.joint_limb) == limb)
            if len(joints):
                places[str(name).rpartition("/")[2]] = int(joints[-1])
    panels: dict[str, dict[str, np.ndarray]] = {}
    for name, joint in places.items():
        words = [word for word in name.split() if word not in ("left", "right")]
        color = next((side for side in ("left", "right") if side in name.split()), "accent")
        title = {"root": "hips", "arm": "hands", "leg": "feet"}.get(" ".join(words), " ".join(words))
        panels.setdefault(title, {})[color] = speed(motion, joint)
    return [Curves(title[:1].upper() + title[1:], "m/s", curves) for title, curves in panels.items()]


def speed(motion: Motion, joint: int) -> Float[np.ndarray, "frame"]:
    """How fast a joint moves, metres per second."""
    places = np.asarray(motion.world_from_joint[:, joint, :3, 3], float)
    if len(places) < 2:
        return np.zeros(len(places))
    return np.linalg.norm(np.gradient(places, np.asarray(motion.time, float), axis=0), axis=1)
