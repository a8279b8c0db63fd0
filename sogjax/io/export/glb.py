"""GLB, glTF in one binary file: one node per bone with tracks of its motion, and the blobs as a skinned mesh.

As glTF prescribes: metres, Y up, a figure in its rest pose looks along +Z.
"""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from sogjax.io.export.bones import Bones, bone_frames, bones_of, check_frames, in_parents, world_turn
from sogjax.io.files import write_file
from sogjax.io.motion_data import MotionData

_FLOAT, _UINT16, _UINT32 = 5126, 5123, 5125
_COMPONENTS = {_FLOAT: np.dtype("<f4"), _UINT16: np.dtype("<u2"), _UINT32: np.dtype("<u4")}


class _Content:
    """The JSON of a glTF file and the binary data that it points to."""

    def __init__(self) -> None:
        self.tree: dict[str, Any] = {"accessors": [], "bufferViews": []}
        self.binary = bytearray()

    def accessor(self, values: np.ndarray, kind: str, component: int = _FLOAT, bounds: bool = False) -> int:
        """Append an array, its first axis counting the elements; the number of its accessor."""
        data = np.ascontiguousarray(values, _COMPONENTS[component])
        entry: dict[str, Any] = {
            "bufferView": len(self.tree["bufferViews"]),
            "componentType": component,
            "count": len(data),
            "type": kind,
        }
        if bounds:
            flat = data.reshape(len(data), -1)
            entry |= {"min": flat.min(axis=0).tolist(), "max": flat.max(axis=0).tolist()}
        raw = data.tobytes()
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(raw)}
        self.tree["bufferViews"].append(view)
        self.tree["accessors"].append(entry)
        self.binary += raw + bytes(-len(raw) % 4)
        return len(self.tree["accessors"]) - 1

    def written(self) -> bytes:
        """The whole file."""
        self.tree["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.tree, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(self.binary), b"BIN\0") + bytes(self.binary)
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def write_glb(path: Path, motion: MotionData, up: str = "z") -> None:
    """Write a motion whose world has the vertical `up`."""
    check_frames(path, motion)
    bones = bones_of(motion)
    rotations, positions = bone_frames(motion, bones, up, "y")
    local_rotations, offsets = in_parents(bones, rotations, positions)
    turns = _quaternions(local_rotations)
    content = _Content()
    children = [[k for k, above in enumerate(bones.parents) if above == bone] for bone in range(len(bones.names))]
    nodes = [
        {"name": name, "translation": offsets[0, k].tolist(), "rotation": turns[0, k].tolist()}
        | ({"children": children[k]} if children[k] else {})
        for k, name in enumerate(bones.names)
    ]
    roots = [k for k, above in enumerate(bones.parents) if above < 0]
    content.tree |= {
        "asset": {"version": "2.0", "generator": "sogjax", "extras": {"unit": "m", "up": "y", "fps": motion.fps}},
        "nodes": nodes,
        "animations": [_animation(content, motion, turns, offsets)],
    }
    if len(motion.blob_sigma):
        _add_skin(content, motion, bones, rotations[0], positions[0], motion.blob_means[0] @ world_turn(up, "y").T)
        nodes.append({"name": "blobs", "mesh": 0, "skin": 0})
        roots.append(len(nodes) - 1)
    content.tree |= {"scene": 0, "scenes": [{"nodes": roots}]}
    write_file(path, content.written())


def _quaternions(rotations: Float[np.ndarray, "frame bone 3 3"]) -> Float[np.ndarray, "frame bone 4"]:
    """Rotations as x y z w, without jumps of sign."""
    quaternions = Rotation.from_matrix(rotations.reshape(-1, 3, 3)).as_quat().reshape(*rotations.shape[:2], 4)
    jumps = np.sum(quaternions[1:] * quaternions[:-1], axis=-1) < 0
    quaternions[1:] *= np.cumprod(np.where(jumps, -1.0, 1.0), axis=0)[..., None]
    return quaternions


def _animation(content: _Content, motion: MotionData, turns: np.ndarray, offsets: np.ndarray) -> dict[str, Any]:
    """A track of rotation for every bone, and of translation for those that move in their parent's frame."""
    seconds = (motion.frame - motion.frame[0]) / motion.fps
    times = content.accessor(seconds, "SCALAR", bounds=True)
    samplers, channels = [], []
    for bone in range(turns.shape[1]):
        tracks = {"rotation": content.accessor(turns[:, bone], "VEC4")}
        if np.ptp(offsets[:, bone], axis=0).max() > 1e-6:  # metres
            tracks["translation"] = content.accessor(offsets[:, bone], "VEC3")
        for path, output in tracks.items():
            channels.append({"sampler": len(samplers), "target": {"node": bone, "path": path}})
            samplers.append({"input": times, "output": output, "interpolation": "LINEAR"})
    return {"name": "motion", "samplers": samplers, "channels": channels}


def _add_skin(
    content: _Content,
    motion: MotionData,
    bones: Bones,
    rotations: Float[np.ndarray, "bone 3 3"],
    positions: Float[np.ndarray, "bone 3"],
    centres: Float[np.ndarray, "blob 3"],
) -> None:
    """An octahedron for each blob, which moves with its bone; given is the first frame, in glTF's axes."""
    radii = 1.35  # half the height of an octahedron, in sigmas: a disc of this radius fits the blob's picture best
    vertices = np.concatenate([np.eye(3), -np.eye(3)])
    triangles = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
    bone_of = {joint: bone for bone, chain in enumerate(bones.chains) for joint in chain}
    owner = np.array([bone_of[int(joint)] for joint in motion.blob_joint])
    corners = centres[:, None] + radii * motion.blob_sigma[:, None, None] * vertices
    faces = triangles + len(vertices) * np.arange(len(centres))[:, None, None]
    joints, weights = (np.zeros((len(centres), len(vertices), 4)) for _ in range(2))
    joints[..., 0], weights[..., 0] = owner[:, None], 1.0
    bind = np.zeros((len(bones.names), 4, 4))
    bind[:, :3, :3] = np.swapaxes(rotations, -1, -2)
    bind[:, :3, 3] = -np.einsum("bji,bj->bi", rotations, positions)
    bind[:, 3, 3] = 1.0
    attributes = {
        "POSITION": content.accessor(corners.reshape(-1, 3), "VEC3", bounds=True),
        "JOINTS_0": content.accessor(joints.reshape(-1, 4), "VEC4", _UINT16),
        "WEIGHTS_0": content.accessor(weights.reshape(-1, 4), "VEC4"),
    }
    indices = content.accessor(faces.reshape(-1), "SCALAR", _UINT32)
    matrices = content.accessor(np.swapaxes(bind, -1, -2).reshape(-1, 16), "MAT4")  # column by column
    content.tree["meshes"] = [{"name": "blobs", "primitives": [{"attributes": attributes, "indices": indices}]}]
    content.tree["skins"] = [{"joints": list(range(len(bones.names))), "inverseBindMatrices": matrices}]
