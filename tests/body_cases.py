"""Skeletons and bodies for tests, and forward kinematics written a second time, recursively in numpy."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

from sogjax.io.actor_file import load_body, named_body
from sogjax.model.body import Attachments, Body, ShapeGroup
from sogjax.model.skeleton import Skeleton


def random_skeleton(seed, joints=12, dofs=9):
    """A random forest of turning and sliding joints, parents before children."""
    rng = np.random.default_rng(seed)
    axes = rng.normal(size=(joints, 3))
    return Skeleton(
        names=tuple(f"joint{k}" for k in range(joints)),
        parents=tuple(-1 if k == 0 else int(rng.integers(-1, k)) for k in range(joints)),
        dof_names=tuple(f"dof{k}" for k in range(dofs)),
        offsets=jnp.asarray(rng.normal(size=(joints, 3)) * 0.3),
        axes=jnp.asarray(axes / np.linalg.norm(axes, axis=1, keepdims=True)),
        revolute=jnp.asarray(rng.random(joints) < 0.7),
        parameter_transform=jnp.asarray(
            np.where(rng.random((joints, dofs)) < 0.4, rng.normal(size=(joints, dofs)), 0.0)
        ),
        dof_lower=jnp.asarray(np.full(dofs, -1.0)),
        dof_upper=jnp.asarray(np.full(dofs, 1.5)),
    )


def random_body(seed, name="thing", joints=7, dofs=5, blobs=6):
    rng = np.random.default_rng(seed)

    def points(prefix, count):
        return Attachments(
            names=tuple(f"{prefix}{k}" for k in range(count)),
            joints=tuple(int(j) for j in rng.integers(0, joints, count)),
            offsets=jnp.asarray(rng.normal(size=(count, 3)) * 0.1),
        )

    return Body(
        name=name,
        skeleton=random_skeleton(seed, joints, dofs),
        blobs=points("blob", blobs),
        blob_sigmas=jnp.asarray(rng.uniform(0.02, 0.1, blobs)),
        blob_colors=jnp.asarray(rng.uniform(0.0, 1.0, (blobs, 3))),
        landmarks=points("landmark", 3),
        poses={"rest": jnp.asarray(rng.normal(size=dofs) * 0.1), "other": jnp.asarray(np.ones(dofs))},
        shape_groups=(ShapeGroup("all_sizes", blob_sigmas=("blob0", "blob1")),),
    )


posed = jax.jit(lambda body, pose: (body.posed_blobs(pose), body.posed_landmarks(pose)))
"""Blobs and landmarks in a pose, compiled once a shape: quicker in tests than one operation after the other."""


def reference_frames(skeleton, pose):
    """Every joint's frame in the world, by recursion to the parents and scipy's rotations."""
    params = np.asarray(skeleton.parameter_transform, float) @ np.asarray(pose, float)
    offsets, axes = np.asarray(skeleton.offsets, float), np.asarray(skeleton.axes, float)

    @functools.cache
    def frame(joint):
        if joint < 0:
            return np.eye(4)
        local = np.eye(4)
        local[:3, 3] = offsets[joint]
        if skeleton.revolute[joint]:
            local[:3, :3] = Rotation.from_rotvec(axes[joint] * params[joint]).as_matrix()
        else:
            local[:3, 3] += axes[joint] * params[joint]
        return frame(skeleton.parents[joint]) @ local

    return np.stack([frame(joint) for joint in range(len(skeleton.names))])


def reference_points(skeleton, points, pose):
    """Attached points in the world."""
    frames = reference_frames(skeleton, pose)
    offsets = np.asarray(points.offsets, float)
    return np.stack([frames[j, :3, :3] @ o + frames[j, :3, 3] for j, o in zip(points.joints, offsets, strict=True)])


@functools.cache
def shipped(name):
    return load_body(named_body(name))


def landmarks(body, pose):
    """The landmarks of a body in a named pose, or in given values of degrees of freedom, by name."""
    if isinstance(pose, dict):
        values = np.zeros(body.skeleton.num_dofs)
        for dof, value in pose.items():
            values[body.skeleton.dof_names.index(dof)] = value
    else:
        values = np.asarray(body.poses[pose])
    return dict(zip(body.landmarks.names, reference_points(body.skeleton, body.landmarks, values), strict=True))
