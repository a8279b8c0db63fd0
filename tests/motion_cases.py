"""Small motions made by hand: a trunk that walks and turns, with two arms; not posed by the package."""

import numpy as np

from sogjax.io.motion import Motion

JOINTS = (
    ("root_tx", -1, (0.0, 0.0, 0.0)),
    ("root_ty", 0, (0.0, 0.0, 0.0)),
    ("root_tz", 1, (0.0, 0.0, 0.0)),
    ("root_rz", 2, (0.0, 0.0, 0.0)),
    ("left_shoulder_flexion", 3, (0.0, 0.2, 0.4)),
    ("left_shoulder_twist", 4, (0.0, 0.0, 0.0)),
    ("left_elbow", 5, (0.0, 0.3, 0.0)),
    ("right_shoulder_flexion", 3, (0.0, -0.2, 0.4)),
    ("right_elbow", 7, (0.0, -0.3, 0.0)),
)
BLOBS = (
    (3, (0.0, 0.0, 0.0), 0.1),
    (3, (0.0, 0.0, 0.4), 0.1),
    (5, (0.0, 0.15, 0.0), 0.05),
    (6, (0.0, 0.05, 0.0), 0.04),
    (6, (0.0, 0.25, 0.0), 0.04),
    (8, (0.0, -0.25, 0.0), 0.04),
)
SLIDE_AXIS = {"root_tx": 0, "root_ty": 1, "root_tz": 2}
TURN_AXIS = {"root_rz": 2, "left_shoulder_twist": 1}


def walking_motion(num_frames=12, fps=50.0, start=(0.0, 0.0, 1.0), still=False, first_frame=0):
    """A motion along x that turns about the vertical and swings its arms."""
    t = np.arange(num_frames)
    params = np.zeros((num_frames, len(JOINTS)))
    params[:, :3] = start
    if not still:
        params[:, 0] += 0.03 * t
        params[:, 3] = 0.05 * t
        params[:, 4] = 0.4 * np.sin(0.5 * t)
        params[:, 5] = 0.1 * t
        params[:, 6] = 0.3 * np.sin(0.7 * t)
        params[:, 7] = -0.4 * np.sin(0.5 * t)
        params[:, 8] = 0.2 * np.cos(0.3 * t)
    world_from_joint = np.stack([pose_frames(row) for row in params])
    joints = np.array([joint for joint, _, _ in BLOBS])
    offsets = np.array([offset for _, offset, _ in BLOBS])
    frames = world_from_joint[:, joints]
    names = np.array([name for name, _, _ in JOINTS])
    return Motion(
        fps=fps,
        frame=t + first_frame,
        time=(t + first_frame) / fps,
        pose=params,
        dof_names=names,
        joint_params=params,
        joint_param_names=names,
        joint_names=names,
        joint_parents=np.array([parent for _, parent, _ in JOINTS]),
        world_from_joint=world_from_joint,
        blob_means=(frames[..., :3, :3] @ offsets[None, :, :, None])[..., 0] + frames[..., :3, 3],
        blob_joint=joints,
        blob_sigma=np.array([sigma for _, _, sigma in BLOBS]),
        similarity=np.linspace(0.5, 0.6, num_frames),
        energy=np.linspace(0.4, 0.5, num_frames),
        iterations=np.full(num_frames, 17),
        converged=np.ones(num_frames, bool),
    )


def pose_frames(params):
    """World frames of all joints, one after the other."""
    frames = []
    for (name, parent, offset), value in zip(JOINTS, params, strict=True):
        local = np.eye(4)
        local[:3, 3] = offset
        if name in SLIDE_AXIS:
            local[SLIDE_AXIS[name], 3] += value
        else:
            local[:3, :3] = turn(TURN_AXIS.get(name, 0), value)
        frames.append(local if parent < 0 else frames[parent] @ local)
    return np.stack(frames)


def turn(axis, angle):
    """A rotation about a coordinate axis."""
    a, b = [k for k in range(3) if k != axis]
    sign = -1.0 if axis == 1 else 1.0
    matrix = np.eye(3)
    matrix[a, a] = matrix[b, b] = np.cos(angle)
    matrix[b, a], matrix[a, b] = sign * np.sin(angle), -sign * np.sin(angle)
    return matrix


def points_on(motion, joints, offsets):
    """World positions, by frame, of points fixed to joints."""
    frames = motion.world_from_joint[:, list(joints)]
    return np.einsum("tmij,mj->tmi", frames[..., :3, :3], np.asarray(offsets, float)) + frames[..., :3, 3]
