"""A hand-built body with every kind of joint chain, for tests that need no body file."""

import jax.numpy as jnp
import numpy as np

from sogjax.model.body import Attachments, Body
from sogjax.model.skeleton import Skeleton

_X, _Y, _Z = np.eye(3).tolist()
_JOINTS = [
    # name, parent, offset, axis, turns
    ("root_tx", None, (0, 0, 0), _X, False),
    ("root_ty", "root_tx", (0, 0, 0), _Y, False),
    ("root_tz", "root_ty", (0, 0, 0), _Z, False),
    ("root_rz", "root_tz", (0, 0, 0), _Z, True),
    ("root_ry", "root_rz", (0, 0, 0), _Y, True),
    ("root_rx", "root_ry", (0, 0, 0), _X, True),
    ("spine_bend", "root_rx", (0, 0, 0.2), _Y, True),
    ("spine_twist", "spine_bend", (0, 0, 0), _Z, True),
    ("left_shoulder_swing", "spine_twist", (0, 0.2, 0.3), _X, True),
    ("left_shoulder_raise", "left_shoulder_swing", (0, 0, 0), _Y, True),
    ("left_shoulder_roll", "left_shoulder_raise", (0, 0, 0), _Z, True),
    ("left_elbow", "left_shoulder_roll", (0, 0.3, 0), _Z, True),
    ("neck", "spine_twist", (0, 0, 0), _Y, True),
    ("telescope", "neck", (0, 0, 0.1), _Z, False),
    ("head", "telescope", (0, 0, 0.05), _X, True),
    ("left_hip", "root_rx", (0, 0.1, -0.05), [0.6, 0.8, 0.0], True),
]


def make_body():
    """The body; its degrees of freedom are its joints, but the elbow also turns the shoulder's roll by half."""
    names = [joint[0] for joint in _JOINTS]
    transform = np.eye(len(names))
    transform[names.index("left_shoulder_roll"), names.index("left_elbow")] = 0.5
    offsets, axes = (np.array([joint[k] for joint in _JOINTS], float) for k in (2, 3))
    skeleton = Skeleton(
        names=tuple(names),
        parents=tuple(-1 if joint[1] is None else names.index(joint[1]) for joint in _JOINTS),
        dof_names=tuple(names),
        offsets=jnp.asarray(offsets),
        axes=jnp.asarray(axes),
        revolute=jnp.array([joint[4] for joint in _JOINTS]),
        parameter_transform=jnp.asarray(transform),
        dof_lower=jnp.full(len(names), -jnp.inf),
        dof_upper=jnp.full(len(names), jnp.inf),
    )
    blobs = Attachments(
        ("belly", "hand", "face"),
        (names.index("spine_twist"), names.index("left_elbow"), names.index("head")),
        jnp.array([[0.1, 0.0, 0.1], [0.0, 0.25, 0.0], [0.1, 0.0, 0.1]]),
    )
    return Body(
        name="tiny",
        skeleton=skeleton,
        blobs=blobs,
        blob_sigmas=jnp.array([0.1, 0.05, 0.08]),
        blob_colors=jnp.full((3, 3), 0.5),
        landmarks=Attachments(("hand",), (names.index("left_elbow"),), jnp.array([[0.0, 0.3, 0.0]])),
        poses={"rest": jnp.zeros(len(names))},
    )


def random_poses(body, frames, seed=0):
    """Poses with angles up to 2 rad and slides up to 2 m."""
    return np.random.default_rng(seed).uniform(-2.0, 2.0, (frames, body.skeleton.num_dofs))
