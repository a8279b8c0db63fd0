"""A calibration written by hand in every format, text for text, with the numbers that OpenCV is to get."""

import json

import cv2
import numpy as np

MATRIX = np.array([[1685.5, 0.0, 950.25], [0.0, 1684.0, 530.75], [0.0, 0.0, 1.0]])
SIZE = (1920, 1080)
TURNS = {"left": np.array([1.2, -0.5, 0.3]), "right": np.array([1.1, 0.9, -0.7])}
MOVES = {"left": np.array([0.1, 0.2, 3.5]), "right": np.array([-0.4, 0.35, 4.25])}
"""Metres."""
DISTORTION = np.array([-0.12, 0.08, 0.0015, -0.002, 0.01])
RADIAL = np.array([-0.12, 0.0, 0.0, 0.0, 0.0])


def rotation(name):
    return cv2.Rodrigues(TURNS[name])[0]


def row(values):
    return " ".join(repr(float(value)) for value in np.asarray(values).ravel())


def listed(values):
    return [float(value) for value in np.asarray(values).ravel()]


def toml_text():
    return "\n".join(
        f'[{name}]\nname = "{name}"\nsize = [1920, 1080]\nmatrix = {MATRIX.tolist()}\n'
        f"distortions = {listed(DISTORTION)}\nrotation = {listed(TURNS[name])}\ntranslation = {listed(MOVES[name])}\n"
        for name in TURNS
    )


def opencv_matrix(key, values):
    values = np.atleast_2d(values)
    rows, columns = values.shape
    return f"{key}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: {listed(values)}\n"


def intri_text(sizes=True):
    text = '%YAML:1.0\n---\nnames:\n  - "left"\n  - "right"\n'
    for name in TURNS:
        text += opencv_matrix(f"K_{name}", MATRIX) + opencv_matrix(f"dist_{name}", DISTORTION)
        text += f"H_{name}: 1080\nW_{name}: 1920\n" if sizes else ""
    return text


def extri_text():
    text = '%YAML:1.0\n---\nnames:\n  - "left"\n  - "right"\n'
    text += opencv_matrix("R_left", TURNS["left"][:, None]) + opencv_matrix("Rot_right", rotation("right"))
    for name in TURNS:
        text += opencv_matrix(f"T_{name}", MOVES[name][:, None])
    return text


def skeletool_text():
    """Keys in another order for the second camera, which is animated but stands still; CRLF."""
    matrix = np.eye(4)
    matrix[:3, :3] = MATRIX
    lines = ["Skeletool Camera Calibration File V1.0"]
    for name in TURNS:
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation(name), 1000.0 * MOVES[name]
        moving = [f"extrinsic   {row(pose)} ", f"intrinsic   {row(matrix)} ", "radial      -0.12"]
        still = ["sensor 10 10", "size 1920 1080"]
        if name == "left":
            lines += [f"name          {name}", *still, "animated 0", *moving[::-1]]
        else:
            frames = [line for frame in range(3) for line in (f"frame {frame}", *moving)]
            lines += [f"name          {name}", "animated 1", *frames, *still[::-1]]
    return "\r\n".join(lines) + "\r\n"


def qualisys_text():
    """The first camera's pictures are a part of its sensor, from pixel (100, 40) on."""
    k1, k2, p1, p2, k3 = DISTORTION
    cameras = ""
    for name in TURNS:
        left, top = (100, 40) if name == "left" else (0, 0)
        turned = np.diag([1.0, -1.0, -1.0]) @ rotation(name)
        x, y, z = -1000.0 * rotation(name).T @ MOVES[name]
        elements = " ".join(f'r{i + 1}{j + 1}="{turned[i, j]!r}"' for i in range(3) for j in range(3))
        cameras += (
            (
                f'<camera active="1" avg-residual="0.5" serial="{name}" model="Miqus Video" viewrotation="0">\n'
                f'<fov_video left="{left}" top="{top}" right="{left + 1919}" bottom="{top + 1079}"/>\n'
                f'<transform x="{x!r}" y="{y!r}" z="{z!r}" {elements.replace("np.float64(", "").replace(")", "")}/>\n'
                f'<intrinsic focallength="9.2" sensorMaxU="122879.0" sensorMaxV="69119.0" '
                f'focalLengthU="{MATRIX[0, 0] * 64}" focalLengthV="{MATRIX[1, 1] * 64}" '
                f'centerPointU="{(MATRIX[0, 2] + left) * 64}" centerPointV="{(MATRIX[1, 2] + top) * 64}" skew="0.0" '
                f'radialDistortion1="{k1}" radialDistortion2="{k2}" radialDistortion3="{k3}" '
                f'tangentalDistortion1="{p1}" tangentalDistortion2="{p2}"/>\n</camera>\n'
            )
            .replace("np.float64(", "")
            .replace(')"', '"')
        )
    return f'<?xml version="1.0"?>\n<calibration>\n<cameras>\n{cameras}</cameras>\n</calibration>\n'


def panoptic_text():
    cameras = [
        {
            "name": name,
            "type": "hd",
            "resolution": list(SIZE),
            "K": MATRIX.tolist(),
            "distCoef": listed(DISTORTION),
            "R": rotation(name).tolist(),
            "t": (100.0 * MOVES[name])[:, None].tolist(),
        }
        for name in TURNS
    ]
    return json.dumps({"calibDataSource": "test", "cameras": cameras}, indent=1)


TEXTS = {
    "TOML": toml_text,
    "Skeletool": skeletool_text,
    "Qualisys": qualisys_text,
    "Panoptic": panoptic_text,
}
"""The formats of one file."""


def write(folder, kind, name="calibration.any"):
    """Write a file of a format (of EasyMocap both, and give the first) and return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    if kind == "EasyMocap":
        (folder / "extri.yml").write_text(extri_text())
        (folder / "intri.yml").write_text(intri_text())
        return folder / "intri.yml"
    path = folder / name
    path.write_bytes(TEXTS[kind]().encode())
    return path
