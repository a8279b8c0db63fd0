"""The shape of a clothed person: tapered limbs, trunk, head, hands and shoes as one smooth implicit surface."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from sogjax.synth.anatomy import INDEX, SIDES, Anatomy, Pose
from sogjax.synth.limbs import pose_from_angles

PARTS = ("torso", "head", "left_arm", "right_arm", "left_leg", "right_leg")

AVERAGE_STATURE = 1.75
"""Metres; lumps, landmarks and clothes are measured on a person of this height."""


@dataclass(frozen=True)
class Lump:
    """A tapered capsule fixed to a joint; metres, in the joint's frame."""

    joint: str
    part: str
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radii: tuple[float, float]
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Factors along the joint's axes."""
    floor: float | None = None
    """Height at which it is cut flat (soles)."""

    def distance(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        """Signed distance (approximate where scaled) of points in the joint's frame."""
        scale = np.array(self.scale)
        start, end = np.array(self.start) / scale, np.array(self.end) / scale
        from_start = points / scale - start
        axis = end - start
        length = axis @ axis
        along = np.clip(from_start @ axis / length, 0.0, 1.0) if length > 0.0 else np.zeros(len(points))
        aside = from_start - along[:, None] * axis
        gap = np.sqrt(np.einsum("ni,ni->n", aside, aside))
        distance = (gap - (self.radii[0] + along * (self.radii[1] - self.radii[0]))) * scale.min()
        return distance if self.floor is None else np.maximum(distance, self.floor - points[:, 2])


def bind_pose(anatomy: Anatomy) -> Pose:
    """The pose the surface is modelled in: arms half raised, legs a little apart, feet flat."""
    angles = {f"{side}_{name}": angle for side in SIDES for name, angle in _BIND_ANGLES.items()}
    pose = pose_from_angles(angles, np.array([0.0, 0.0, anatomy.hip_height]))
    for side in SIDES:
        pose = pose.with_rotation(f"{side}_ankle", pose.rotations[INDEX[f"{side}_hip"]].T)
    return pose


_BIND_ANGLES = {"raise": 55.0, "plane": 90.0, "spread": 8.0}


@dataclass(frozen=True)
class Flesh:
    """The implicit surface of one person in the bind pose."""

    lumps: tuple[Lump, ...]
    world_from_joint: Float[np.ndarray, "22 4 4"]

    def distances(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "lump n"]:
        """Distance of each point (world) to each lump."""
        rows = []
        for lump in self.lumps:
            frame = self.world_from_joint[INDEX[lump.joint]]
            rows.append(lump.distance((points - frame[:3, 3]) @ frame[:3, :3]))
        return np.stack(rows)

    def field(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        """Signed distance to the surface, the lumps melted together: over 10 mm within a part, over 22 mm between."""
        rows = self.distances(points)
        owner = np.array([PARTS.index(lump.part) for lump in self.lumps])
        parts = [_smooth_minimum(rows[owner == k], 0.010) for k in range(len(PARTS))]
        return _smooth_minimum(np.stack(parts), 0.022)

    def nearest_lump(self, points: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, "n"]:
        """Index of the lump each point lies on."""
        return np.argmin(self.distances(points), axis=0)


def _smooth_minimum(rows: Float[np.ndarray, "k n"], width: float) -> Float[np.ndarray, "n"]:
    lowest = rows.min(0)
    return lowest - width * np.log(np.exp((lowest - rows) / width).sum(0))


def flesh_of(anatomy: Anatomy, sleeve: float) -> Flesh:
    """The shape of a person whose sleeves reach so far: 0 shoulder, 1 elbow, 2 wrist."""
    lumps = [*_trunk(anatomy), *_HEAD]
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        lumps += _arm(anatomy, side, sign, sleeve) + _leg(anatomy, side)
    return Flesh(tuple(_sized(lump, anatomy) for lump in lumps), anatomy.world_from_joint(bind_pose(anatomy)))


def _sized(lump: Lump, anatomy: Anatomy) -> Lump:
    """A lump of the average person, for another stature and girth; heads, hands and shoes do not get thicker."""
    scale = anatomy.stature / AVERAGE_STATURE
    thickness = scale * (1.0 if lump.joint.endswith(("head", "wrist", "ankle", "toe")) else anatomy.girth)
    resized = lambda point: (float(scale * point[0]), float(scale * point[1]), float(scale * point[2]))
    radii = (thickness * lump.radii[0], thickness * lump.radii[1])
    floor = None if lump.floor is None else scale * lump.floor
    return replace(lump, start=resized(lump.start), end=resized(lump.end), radii=radii, floor=floor)


def _average(anatomy: Anatomy, joint: str) -> float:
    """Length of the bone to a joint, were the person of average stature."""
    return anatomy.length(joint) / anatomy.stature * AVERAGE_STATURE


def _trunk(anatomy: Anatomy) -> list[Lump]:
    wide = anatomy.shoulder_breadth

    def slab(joint: str, x: float, half: float, z: float, radius: float, depth: float) -> Lump:
        return Lump(joint, "torso", (x, -half, z), (x, half, z), (radius, radius), (depth, 1.0, 1.0))

    lumps = [
        slab("pelvis", -0.005, 0.072, 0.005, 0.104, 1.02),
        slab("pelvis", 0.0, 0.060, 0.075, 0.098, 1.0),
        slab("spine", 0.008, 0.056, 0.06, 0.093, 1.05),
        slab("waist", 0.006, 0.060, 0.055, 0.096, 1.05),
        slab("chest", 0.002, 0.070, 0.025, 0.104, 1.04),
        slab("chest", 0.002, 0.088 * wide, 0.105, 0.094, 1.02),
        slab("chest", -0.010, 0.060 * wide, 0.175, 0.066, 1.0),
    ]
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        breast = Lump("chest", "torso", (0.05, 0.07 * sign, 0.06), (0.05, 0.075 * sign, 0.06), (0.068, 0.068))
        buttock = Lump("pelvis", "torso", (-0.05, 0.07 * sign, -0.03), (-0.05, 0.07 * sign, 0.0), (0.082, 0.08))
        end = (-0.01, 0.125 * sign * wide, -0.03)
        yoke = Lump(f"{side}_clavicle", "torso", (-0.01, 0.0, -0.02), end, (0.058, 0.054))
        slope = Lump("neck", "torso", (0.0, 0.02 * sign, 0.03), (-0.008, 0.11 * sign * wide, -0.035), (0.042, 0.045))
        lumps += [breast, buttock, yoke, slope]
    return lumps


_HEAD = (
    Lump("neck", "head", (-0.004, 0.0, -0.01), (0.008, 0.0, 0.10), (0.054, 0.052)),
    Lump("head", "head", (0.008, 0.0, 0.062), (0.004, 0.0, 0.068), (0.1, 0.1), (0.96, 0.77, 1.0)),
    Lump("head", "head", (0.034, 0.0, 0.01), (0.05, 0.0, -0.022), (0.066, 0.046), (1.0, 0.88, 1.0)),
    Lump("head", "head", (0.098, 0.0, 0.045), (0.108, 0.0, 0.02), (0.010, 0.015)),
    Lump("head", "head", (0.0, 0.075, 0.05), (-0.008, 0.076, 0.02), (0.018, 0.014), (1.0, 0.6, 1.0)),
    Lump("head", "head", (0.0, -0.075, 0.05), (-0.008, -0.076, 0.02), (0.018, 0.014), (1.0, 0.6, 1.0)),
)
"""Neck, skull, jaw, nose and ears."""


def _arm(anatomy: Anatomy, side: str, sign: float, sleeve: float) -> list[Lump]:
    """Muscles, forearm, hand and thumb, and the sleeve over them."""
    part = f"{side}_arm"
    upper, lower = _average(anatomy, f"{side}_elbow"), _average(anatomy, f"{side}_wrist")
    flat = (1.0, 0.48, 1.0)
    lumps = [
        Lump(f"{side}_shoulder", part, (0.0, 0.0, -0.01), (0.0, 0.004 * sign, -0.10), (0.056, 0.054)),
        Lump(f"{side}_shoulder", part, (0.0, 0.0, -0.05), (0.0, 0.0, -upper), (0.050, 0.039)),
        Lump(f"{side}_elbow", part, (0.0, 0.0, 0.0), (0.002, 0.0, -0.07), (0.039, 0.043)),
        Lump(f"{side}_elbow", part, (0.002, 0.0, -0.07), (0.0, 0.0, -lower), (0.043, 0.027)),
        Lump(f"{side}_wrist", part, (0.0, 0.0, -0.025), (0.002, 0.0, -0.085), (0.038, 0.042), flat),
        Lump(f"{side}_wrist", part, (0.002, 0.0, -0.09), (0.002, -0.018 * sign, -0.165), (0.038, 0.028), flat),
        Lump(f"{side}_wrist", part, (0.022, 0.0, -0.035), (0.052, -0.012 * sign, -0.095), (0.017, 0.012)),
    ]
    reach = sleeve * upper if sleeve <= 1.0 else upper
    lumps.append(Lump(f"{side}_shoulder", part, (0.0, 0.0, -0.03), (0.0, 0.0, -reach + 0.04), (0.060, 0.058)))
    if sleeve > 1.0:
        reach = (sleeve - 1.0) * lower
        lumps.append(Lump(f"{side}_elbow", part, (0.0, 0.0, 0.0), (0.0, 0.0, -reach + 0.03), (0.052, 0.040)))
    return lumps


def _leg(anatomy: Anatomy, side: str) -> list[Lump]:
    """Thigh, calf and shoe."""
    part, shoe = f"{side}_leg", (1.0, 1.15, 1.0)
    upper, lower = _average(anatomy, f"{side}_knee"), _average(anatomy, f"{side}_ankle")
    # Melting the lumps together makes the soles about 7 mm thicker.
    ankle = anatomy.ankle_height / anatomy.stature * AVERAGE_STATURE - 0.007
    x, _, z = (float(value) for value in anatomy.offsets[INDEX[f"{side}_toe"]] / anatomy.stature * AVERAGE_STATURE)
    return [
        Lump(f"{side}_hip", part, (0.0, 0.0, -0.03), (0.004, 0.0, -upper), (0.090, 0.062)),
        Lump(f"{side}_knee", part, (0.004, 0.0, 0.0), (-0.008, 0.0, -0.14), (0.062, 0.062)),
        Lump(f"{side}_knee", part, (-0.008, 0.0, -0.14), (-0.008, 0.0, -lower + 0.05), (0.062, 0.050)),
        Lump(f"{side}_ankle", part, (-0.008, 0.0, 0.01), (-0.01, 0.0, -0.03), (0.038, 0.040)),
        Lump(f"{side}_ankle", part, (-0.036, 0.0, -0.04), (0.04, 0.0, -0.04), (0.037, 0.04), floor=-ankle),
        Lump(f"{side}_ankle", part, (0.03, 0.0, -0.035), (x, 0.0, z + 0.005), (0.04, 0.036), shoe, -ankle),
        Lump(f"{side}_toe", part, (0.0, 0.0, 0.005), (0.05, 0.0, 0.0), (0.036, 0.030), shoe, -ankle - z),
    ]
