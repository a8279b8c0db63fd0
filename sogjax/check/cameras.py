"""Where the cameras of a rig stand and look, and which of that no real set-up has."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float

from sogjax.check.findings import Finding
from sogjax.errors import counted, listed
from sogjax.io.calibration.rig import CameraRig
from sogjax.model.rotation import UP_AXES, axis_vector
from sogjax.scene.visual_hull import nearest_point


@dataclass(frozen=True)
class RigGeometry:
    """The cameras in the calibration's world, lengths in metres."""

    names: tuple[str, ...]
    centres: Float[np.ndarray, "camera 3"]
    forwards: Float[np.ndarray, "camera 3"]
    """Viewing directions, unit vectors."""
    uprights: Float[np.ndarray, "camera 3"]
    """The pictures' upward directions, unit vectors."""
    heights: Float[np.ndarray, "camera"]
    """Heights over the plane through the world's origin, along `up`."""
    fields: Float[np.ndarray, "camera 2"]
    """Horizontal and vertical fields of view in degrees."""
    target: Float[np.ndarray, "3"]
    """The point that is nearest to all optical axes: what the cameras look at."""
    distances: Float[np.ndarray, "camera"]
    """Distances from the cameras to the target along their optical axes; negative behind them."""
    baselines: Float[np.ndarray, "camera camera"]

    @property
    def scale(self) -> float:
        """The median distance from the cameras to the target: lengths in this unit have no unit."""
        return float(max(np.median(np.linalg.norm(self.centres - self.target, axis=1)), 1e-9))

    def numbers(self) -> dict:
        """Everything as plain numbers."""
        rows = zip(self.names, self.centres, self.heights, self.fields, self.distances, strict=True)
        cameras = {
            name: {
                "position_m": centre.round(4).tolist(),
                "height_m": round(float(height), 4),
                "field_of_view_deg": field.round(2).tolist(),
                "distance_to_target_m": round(float(distance), 4),
            }
            for name, centre, height, field, distance in rows
        }
        baselines = self.baselines.round(4).tolist()
        return {"cameras": cameras, "target_m": self.target.round(4).tolist(), "baselines_m": baselines}


def rig_geometry(rig: CameraRig, up: str) -> RigGeometry:
    """Where the cameras of a rig stand and look."""
    poses = np.asarray(rig.cameras.camera_from_world, float)
    matrices = np.asarray(rig.cameras.intrinsics, float)
    sizes = np.asarray(rig.cameras.image_size, float)
    centres, forwards = _rays_of(poses)
    target = nearest_point(centres, forwards)
    focal = np.stack([matrices[:, 0, 0], matrices[:, 1, 1]], axis=1)
    return RigGeometry(
        names=rig.names,
        centres=centres,
        forwards=forwards,
        uprights=-poses[:, 1, :3],
        heights=centres @ axis_vector(up),
        fields=2.0 * np.rad2deg(np.arctan(0.5 * sizes / focal)),
        target=target,
        distances=np.einsum("ni,ni->n", target - centres, forwards),
        baselines=np.linalg.norm(centres[:, None] - centres[None, :], axis=-1),
    )


def _rays_of(
    poses: Float[np.ndarray, "camera 4 4"],
) -> tuple[Float[np.ndarray, "camera 3"], Float[np.ndarray, "camera 3"]]:
    """Centres and viewing directions of cameras with such poses (camera from world)."""
    return -np.einsum("nji,nj->ni", poses[:, :3, :3], poses[:, :3, 3]), poses[:, 2, :3]


def camera_findings(rig: CameraRig, geometry: RigGeometry, up: str) -> list[Finding]:
    """What is wrong with the calibration itself, without looking at any picture."""
    turned = _directions(rig, geometry)
    findings = [*_lenses(rig, geometry), *_places(geometry), *turned]
    if not any(finding.severity == "warning" for finding in turned):
        findings += _vertical(geometry, up)
    if not findings:
        low, high = geometry.heights.min(), geometry.heights.max()
        look = f", {geometry.scale:.2f} m from what they look at" if len(rig) > 1 else ""
        what = f"{counted(len(rig), 'camera')} at heights of {low:.2f} to {high:.2f} m{look}"
        findings.append(Finding("ok", "cameras", what))
    return findings


def _lenses(rig: CameraRig, geometry: RigGeometry) -> list[Finding]:
    """Fields of view outside of 8 to 150 degrees, and optical axes farther than 12 % from the picture's middle."""
    findings = []
    matrices, sizes = np.asarray(rig.cameras.intrinsics, float), np.asarray(rig.cameras.image_size, float)
    for k, name in enumerate(rig.names):
        across, down = geometry.fields[k]
        if not 8.0 <= across <= 150.0:
            what = f"{name} has a field of view of {across:.1f} x {down:.1f} degrees"
            cause, remedy = "a focal length that is not in pixels", "calibrate it again, or convert the focal length"
            findings.append(Finding("warning", "cameras", what, cause, remedy, (name,)))
        off = np.abs((matrices[k, :2, 2] + 0.5) / sizes[k] - 0.5).max()
        if off > 0.12:
            x, y = matrices[k, :2, 2]
            what = (
                f"{name} has its optical axis at pixel ({x:.0f}, {y:.0f}) of {sizes[k, 0]:.0f} x {sizes[k, 1]:.0f}, "
                f"{100 * off:.0f} % from the middle"
            )
            cause, remedy = "calibrated at another size or before cropping", "calibrate the pictures as recorded"
            findings.append(Finding("warning", "cameras", what, cause, remedy, (name,)))
    return findings


def _places(geometry: RigGeometry) -> list[Finding]:
    findings = []
    for a, b in combinations(range(len(geometry.names)), 2):
        if geometry.baselines[a, b] < 1e-3 * geometry.scale:
            names = (geometry.names[a], geometry.names[b])
            what = f"{names[0]} and {names[1]} stand at the same place"
            cause, remedy = "one camera's calibration under two names", "calibrate both, or use one of them"
            findings.append(Finding("warning", "cameras", what, cause, remedy, names))
    if len(geometry.names) == 1:
        what = "there is only one camera, so nothing can be compared and depth is hardly visible"
        return [Finding("note", "cameras", what, "", "record with several cameras around the subject")]
    return findings


def _directions(rig: CameraRig, geometry: RigGeometry) -> list[Finding]:
    if len(rig) < 2:
        return []
    poses = np.asarray(rig.cameras.camera_from_world, float)
    if not _converge(poses) and _converge(np.linalg.inv(poses)):
        what = "the cameras do not look at one place, but would if their poses were inverted"
        cause, remedy = "poses from camera to world instead of from world to camera", "export the inverse poses"
        return [Finding("warning", "calibration", what, cause, remedy)]
    cosines = geometry.forwards @ geometry.forwards.T
    widest = float(np.rad2deg(np.arccos(np.clip(cosines.min(), -1.0, 1.0))))
    if widest < 8.0:
        what = f"all cameras look in the same direction within {widest:.1f} degrees, so depth is hardly visible"
        return [Finding("note", "cameras", what, "", "place cameras around the subject, at least 30 degrees apart")]
    behind = tuple(name for name, distance in zip(rig.names, geometry.distances, strict=True) if distance <= 0)
    if not behind:
        return []
    what = f"{listed(behind)} look away from the place where the optical axes nearly meet"
    cause = "a wrong calibration"
    if len(behind) == len(rig):
        cause = "cameras that look along -z, as in OpenGL and Blender, instead of OpenCV's +z"
    return [Finding("warning", "calibration", what, cause, "calibrate them again, or convert the axes", behind)]


def _converge(poses: Float[np.ndarray, "camera 4 4"]) -> bool:
    """Whether cameras in different places all look, roughly, at one point before them.

    Their places differ by a tenth of their distance from the origin: inverse poses put all cameras near one place.
    """
    centres, forwards = _rays_of(poses)
    towards = nearest_point(centres, forwards) - centres
    distances = np.linalg.norm(towards, axis=1)
    apart = np.linalg.norm(centres - centres.mean(axis=0), axis=1).max()
    aligned = np.einsum("ni,ni->n", towards, forwards) > 0.8 * distances
    return bool(aligned.all() and apart > 0.1 * np.median(np.linalg.norm(poses[:, :3, 3], axis=1)))


def _vertical(geometry: RigGeometry, up: str) -> list[Finding]:
    """A vertical that is not upwards in the pictures, and cameras farther below the floor than a rough zero tells."""
    mean = geometry.uprights.mean(axis=0)
    fits = {axis: float(mean @ axis_vector(axis)) for axis in UP_AXES}
    best = max(fits, key=fits.__getitem__)
    findings = []
    if fits[up] < 0.5 < fits[best]:
        what = f"`up: {up}` is the vertical, but in the pictures {best} points upward"
        remedy = f"write `up: {best}` into recording.yaml"
        findings.append(Finding("warning", "vertical", what, "a wrong `up`", remedy))
    elif fits[up] < 0.5:
        what = f"`up: {up}` points upward in hardly any picture, and neither does any other axis"
        cause, remedy = "a world that was never levelled, or pictures turned on their side", "level the calibration"
        findings.append(Finding("warning", "vertical", what, cause, remedy))
    low = geometry.heights < -0.1 * geometry.scale
    if low.any() and not findings:
        names = tuple(name for name, under in zip(geometry.names, low, strict=True) if under)
        what = f"{listed(names)} stand below the floor, the lowest at {geometry.heights.min():.2f} m"
        cause, remedy = "a world whose zero is not on the floor", "nothing, if intended; else level the calibration"
        findings.append(Finding("note", "vertical", what, cause, remedy, names))
    return findings
