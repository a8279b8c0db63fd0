"""The calibrated cameras of a recording, by name, and the checks that every calibration passes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError, counted
from sogjax.io.files import objection
from sogjax.model.camera import Camera

MAX_BYTES = 16 * 2**20
"""A larger file is no calibration."""

METRES_PER_UNIT = {"m": 1.0, "mm": 1e-3}
"""The units of length that `unit` may name."""

METRES = METRES_PER_UNIT | {"cm": 1e-2}
"""All units of length that a format may prescribe."""

LARGEST = 1e12
"""No number of a calibration is larger."""


@dataclass(frozen=True)
class CameraRig:
    """Named cameras: a `Camera` whose leaves have a leading camera axis in the order of `names`."""

    names: tuple[str, ...]
    cameras: Camera

    def __len__(self) -> int:
        """Number of cameras."""
        return len(self.names)

    def camera(self, name: str) -> Camera:
        """The one camera called `name`, without a camera axis."""
        index = self.names.index(name)
        return jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf)[index]), self.cameras)

    def image_size(self, name: str) -> tuple[int, int]:
        """Width and height of a camera's images, in pixels.

        Raises:
            InputError: the calibration did not say, and nothing else did.
        """
        width, height = np.asarray(self.cameras.image_size)[self.names.index(name)]
        if np.isnan(width):
            raise InputError(f"camera {name!r}: the calibration does not say how large its images are; add their size")
        return int(width), int(height)

    def is_fisheye(self, name: str) -> bool:
        """Whether a camera has OpenCV's fisheye model."""
        return self.cameras.fisheye is not None and bool(self.cameras.fisheye[self.names.index(name)])

    def with_sizes(self, sizes: Mapping[str, tuple[int, int]]) -> "CameraRig":
        """The rig with the image sizes that were not known yet."""
        known = np.array(self.cameras.image_size)
        for index, name in enumerate(self.names):
            if np.isnan(known[index]).any() and name in sizes:
                known[index] = sizes[name]
        filled = jnp.asarray(known, self.cameras.image_size.dtype)
        return CameraRig(self.names, eqx.tree_at(lambda cameras: cameras.image_size, self.cameras, filled))

    def select(self, names: Sequence[str]) -> "CameraRig":
        """The rig of `names`, in their order."""
        indices = np.array([self.names.index(name) for name in names], int)
        return CameraRig(tuple(names), jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf)[indices]), self.cameras))


@dataclass(frozen=True)
class CameraEntry:
    """A camera as read from a file, not yet checked; lengths in metres."""

    name: str
    intrinsics: Float[np.ndarray, "3 3"]
    rotation: Float[np.ndarray, "3 3"]
    """World to camera."""
    translation: Float[np.ndarray, "3"]
    distortion: Float[np.ndarray, "coefficient"]
    """OpenCV's k1 k2 p1 p2 [k3]; of a fisheye camera k1 k2 k3 k4."""
    size: tuple[int, int] | None
    """Width and height of its pictures; None where the file does not say."""
    fisheye: bool = False


def rig_from_entries(path: Path, entries: Sequence[CameraEntry]) -> CameraRig:
    """The rig of the cameras read from `path`.

    Raises:
        InputError: no camera, two of one name, or a value that no camera can have.
    """
    if not entries:
        raise InputError(f"{path}: holds no camera; give a calibration with at least one")
    names = tuple(entry.name for entry in entries)
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{path}: the camera name {name!r} occurs twice; give every camera its own name")
    for entry in entries:
        _check(path, entry)
    stack = lambda arrays: jnp.asarray(np.stack(arrays).astype(float))
    return CameraRig(
        names,
        Camera(
            intrinsics=stack([entry.intrinsics for entry in entries]),
            camera_from_world=stack([_camera_from_world(entry) for entry in entries]),
            distortion=stack([np.pad(entry.distortion, (0, 5 - len(entry.distortion))) for entry in entries]),
            image_size=stack([np.array(entry.size or (np.nan, np.nan)) for entry in entries]),
            fisheye=jnp.array([entry.fisheye for entry in entries]) if any(e.fisheye for e in entries) else None,
        ),
    )


def _check(path: Path, entry: CameraEntry) -> None:
    where = f"{path}: camera {entry.name!r}"
    if (wanted := objection(entry.name)) is not None:
        raise InputError(
            f"{path}: a camera is named {entry.name[:60]!r}; give it {wanted}, as files are named after it"
        )
    arrays = {
        "intrinsic matrix": entry.intrinsics,
        "rotation": entry.rotation,
        "translation": entry.translation,
        "distortion": entry.distortion,
    }
    for what, values in arrays.items():
        if not (np.abs(values) < LARGEST).all():  # NaN fails too
            raise InputError(f"{where}: its {what} {_text(values)} is not finite; calibrate it again")
    if entry.size is not None and not 0 < min(entry.size) <= max(entry.size) <= 100_000:
        raise InputError(
            f"{where}: its size {list(entry.size)} is not positive or too large; give width and height in pixels"
        )
    _check_intrinsics(where, entry.intrinsics)
    rotation = entry.rotation
    deviation = np.abs(rotation @ rotation.T - np.eye(3)).max()
    if deviation > 1e-3 or np.linalg.det(rotation) < 0:  # files with four digits pass
        raise InputError(
            f"{where}: {_text(rotation)} is not a rotation matrix (determinant {np.linalg.det(rotation):.3g}, "
            f"R R^T differs from 1 by {deviation:.3g}); calibrate it again or export it with more digits"
        )
    given = counted(len(entry.distortion), "distortion coefficient")
    if entry.fisheye and len(entry.distortion) != 4:
        raise InputError(f"{where}: it has {given}; a fisheye camera has k1 k2 k3 k4")
    if len(entry.distortion) not in (4, 5):
        raise InputError(f"{where}: it has {given}; give k1 k2 p1 p2 [k3]")


def _check_intrinsics(where: str, matrix: Float[np.ndarray, "3 3"]) -> None:
    if min(matrix[0, 0], matrix[1, 1]) <= 0:
        focal = f"{matrix[0, 0]:g} and {matrix[1, 1]:g}"
        raise InputError(f"{where}: its focal lengths {focal} are not positive; give them in pixels")
    if np.abs(matrix[[0, 1, 2, 2], [1, 0, 0, 1]]).max() > 1e-6 * matrix[0, 0] or abs(matrix[2, 2] - 1) > 1e-6:
        raise InputError(
            f"{where}: its matrix {_text(matrix)} is not [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]; "
            "calibrate it without skew"
        )


def _camera_from_world(entry: CameraEntry) -> Float[np.ndarray, "4 4"]:
    u, _, vt = np.linalg.svd(entry.rotation)
    transform = np.eye(4)
    transform[:3, :3] = u @ vt
    transform[:3, 3] = entry.translation
    return transform


def _text(values: np.ndarray) -> str:
    return str([float(f"{value:.6g}") for value in values.ravel()])
