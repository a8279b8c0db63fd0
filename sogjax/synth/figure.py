"""A rendered person: a surface in the bind pose, skinned to a skeleton by linear blending."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy import sparse

from sogjax.synth.anatomy import INDEX, JOINTS, PARENTS, SIDES, Anatomy, Pose
from sogjax.synth.clothes import Outfit, Wardrobe
from sogjax.synth.flesh import AVERAGE_STATURE, PARTS, Flesh, bind_pose, flesh_of
from sogjax.synth.rotations import partial_twist, unit
from sogjax.synth.surface import gradient, surface_nets

_NEAR = tuple(f"{side}_{joint}" for side in SIDES for joint in ("shoulder", "hip"))
_FAR = tuple(f"{side}_elbow" for side in SIDES)
BONES = JOINTS + tuple(f"{name}_near" for name in _NEAR) + tuple(f"{name}_far" for name in _FAR)


@dataclass(frozen=True)
class Mesh:
    """A posed surface; metres, world."""

    vertices: Float[np.ndarray, "vertex 3"]
    normals: Float[np.ndarray, "vertex 3"]
    faces: Int[np.ndarray, "face 3"]


@dataclass(frozen=True)
class Figure:
    """One person: skeleton, surface in the bind pose, the bones that move it, clothes."""

    anatomy: Anatomy
    outfit: Outfit
    rest: Float[np.ndarray, "vertex 3"]
    """Vertices in the bind pose, metres; also the coordinates the clothes' patterns are drawn in."""
    rest_normals: Float[np.ndarray, "vertex 3"]
    faces: Int[np.ndarray, "face 3"]
    face_part: Int[np.ndarray, "face"]
    weights: Float[np.ndarray, "vertex bone"]
    bone_from_rest: Float[np.ndarray, "bone 4 4"]

    @cached_property
    def wardrobe(self) -> Wardrobe:
        """The outfit fitted to the person."""
        return Wardrobe.fitted(self.outfit, self.anatomy)

    def posed(self, pose: Pose) -> Mesh:
        """The surface in a pose (linear blend skinning)."""
        moved = (bone_frames(self.anatomy, pose) @ self.bone_from_rest)[:, :3].reshape(len(BONES), 12)
        blended = (self.weights @ moved).reshape(-1, 3, 4)
        vertices = np.einsum("vij,vj->vi", blended[..., :3], self.rest) + blended[..., 3]
        normals = unit(np.einsum("vij,vj->vi", blended[..., :3], self.rest_normals))
        return Mesh(vertices, normals, self.faces)


def bone_frames(anatomy: Anatomy, pose: Pose) -> Float[np.ndarray, "bone 4 4"]:
    """Frames of the joints and of the flesh that follows only a part of a joint's twist.

    The beginning of a limb follows 0.35 of its own, the far half of the forearm 0.6 of the wrist's.
    """
    frames = anatomy.world_from_joint(pose)
    extra = []
    for name in _NEAR:
        joint = INDEX[name]
        above = frames[PARENTS[joint], :3, :3]
        bone = frames[joint].copy()
        bone[:3, :3] = above @ partial_twist(pose.rotations[joint], 0.35)
        extra.append(bone)
    for name in _FAR:
        wrist = pose.rotations[INDEX[name.replace("elbow", "wrist")]]
        swing = partial_twist(wrist, 0.0)
        twist = swing.T @ wrist
        bone = frames[INDEX[name]].copy()
        bone[:3, :3] = bone[:3, :3] @ partial_twist(twist, 0.6)
        extra.append(bone)
    return np.concatenate([frames, np.stack(extra)])


def make_figure(anatomy: Anatomy, outfit: Outfit) -> Figure:
    """Model the surface of a person and tie it to the skeleton."""
    flesh = flesh_of(anatomy, outfit.sleeve)
    centres = flesh.world_from_joint[:, :3, 3]
    lower, upper = np.append(centres.min(0)[:2] - 0.25, -0.03), centres.max(0) + 0.25
    vertices, faces = surface_nets(flesh.field, lower, upper, 0.026 * anatomy.stature / AVERAGE_STATURE)
    nearest = flesh.nearest_lump(vertices)
    part = np.array([PARTS.index(lump.part) for lump in flesh.lumps])[nearest]
    weights = _diffused(_owners(anatomy, flesh, vertices, nearest), faces)
    frames = bone_frames(anatomy, bind_pose(anatomy))
    return Figure(
        anatomy=anatomy,
        outfit=outfit,
        rest=vertices,
        rest_normals=unit(gradient(flesh.field, vertices)),
        faces=faces,
        face_part=np.median(part[faces], axis=1).astype(int),
        weights=weights,
        bone_from_rest=np.linalg.inv(frames),
    )


def _owners(
    anatomy: Anatomy, flesh: Flesh, vertices: Float[np.ndarray, "vertex 3"], nearest: Int[np.ndarray, "vertex"]
) -> Float[np.ndarray, "vertex bone"]:
    """Each vertex wholly on the bone of the lump it lies on."""
    bone = np.array([JOINTS.index(lump.joint) for lump in flesh.lumps])[nearest]
    for name in (*_NEAR, *_FAR):
        side, _, joint = name.partition("_")
        end = {"shoulder": "elbow", "hip": "knee", "elbow": "wrist"}[joint]
        frame = flesh.world_from_joint[INDEX[name]]
        along = -((vertices - frame[:3, 3]) @ frame[:3, 2]) / anatomy.length(f"{side}_{end}")
        part, there = ("near", along < 0.4) if name in _NEAR else ("far", along > 0.5)
        bone[(bone == INDEX[name]) & there] = BONES.index(f"{name}_{part}")
    return np.eye(len(BONES))[bone]


def _diffused(
    weights: Float[np.ndarray, "vertex bone"], faces: Int[np.ndarray, "face 3"]
) -> Float[np.ndarray, "vertex bone"]:
    """Weights smoothed along the surface, so that a leg never takes hold of the other one."""
    count = len(weights)
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    links = sparse.csr_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    links.data[:] = 1.0
    share = sparse.diags(0.5 / np.asarray(links.sum(1)).ravel()) @ links
    for _ in range(14):
        weights = 0.5 * weights + share @ weights
    return weights
