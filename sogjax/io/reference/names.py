"""What other systems call the points and segments of a body: the names that are matched."""

from sogjax.io.export.points import OPENSIM_ENDS, OPENSIM_NAMES

SIDES = ("left", "right")
_FACE = {f"{side[0].upper()}{name.title()}": f"{side}_{name}" for side in SIDES for name in ("eye", "ear")}
_OURS = OPENSIM_NAMES | OPENSIM_ENDS | {"pelvis": "Hip"}
_MARKERS = {theirs: ours for ours, theirs in _OURS.items()} | {"Nose": "nose"} | _FACE
_SIDES_BONES = {
    **{"UpLeg": ("hip", "thigh"), "Leg": ("knee", "shank"), "Foot": ("ankle", "foot")},
    **{"Arm": ("shoulder", "upper_arm"), "ForeArm": ("elbow", "forearm"), "Hand": ("wrist", "hand")},
}
_SPINE = ("Spine", "Spine1", "Spine2", "Spine3")
"""Links of other skeletons' spines, which begin elsewhere than ours."""
_BONES = {"Hips": ("pelvis", "pelvis"), "Spine2": ("", "chest"), "Neck": ("neck", ""), "Head": ("head", "head")} | {
    f"{side.title()}{name}": (f"{side}_{joint}", f"{side}_{segment}")
    for side in SIDES
    for name, (joint, segment) in _SIDES_BONES.items()
}
"""The names of animation programs: the point that a bone begins at, and the segment that it is."""
_TOES = {f"{side.title()}{name}": f"{side}_toe" for side in SIDES for name in ("Toe", "ToeBase")}
_OWN_SIDES = {
    **{"hip": "thigh", "knee": "shank", "ankle": "foot", "upper_arm_roll": "upper_arm", "elbow": "forearm"},
    **{"forearm_roll2": "forearm_end", "wrist": "hand"},
}
_OWN_BONES = {"root": "pelvis", "spine5": "chest", "head": "head"} | {
    f"{side}_{name}": f"{side}_{segment}" for side in SIDES for name, segment in _OWN_SIDES.items()
}


def point_named(name: str, of_bones: bool) -> str:
    """What the body calls a point that a file calls `name`; the name itself where it is not one of the known ones.

    With `of_bones` it is where a bone begins: an animation program's `Head` is no top of the head.
    """
    plain = name.rsplit(":", 1)[-1].strip()
    known = {bone: point for bone, (point, _) in _BONES.items() if point} | _TOES if of_bones else _MARKERS
    if plain in known or plain in _SPINE:
        return known.get(plain, plain)
    lower = plain.lower().replace(" ", "_")
    return {"l_": "left_", "r_": "right_"}.get(lower[:2], lower[:2]) + lower[2:]


def segment_named(bone: str) -> str | None:
    """The segment that a file's bone is; None where its name is not a known one."""
    plain = bone.rsplit(":", 1)[-1].strip()
    return _OWN_BONES.get(plain) or _BONES.get(plain, ("", ""))[1] or None
