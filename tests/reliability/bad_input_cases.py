"""The table of what is wrong, by family."""

import io
import zipfile
from pathlib import Path

import numpy as np
from bad_inputs import (
    ACTOR,
    EVALUATE,
    EXPORT,
    SEGMENT,
    TRACK,
    VIEW,
    BadInput,
    Damage,
    arrays,
    cut,
    edit,
    gone,
    nothing,
    picture,
    video,
    write,
)

CAL, REC, BODY, POSE = "walk/calibration.toml", "walk/recording.yaml", "actor.yaml", "walk/initial_pose.yaml"
TPOSE = "walk/example_poses/tpose"


def cases() -> list[BadInput]:
    """All of them."""
    rows: list[tuple[str, str, Damage, tuple[str, ...]]] = [
        *(("calibration", what, damage, TRACK) for what, damage in CALIBRATION),
        *(("video", what, damage, TRACK) for what, damage in VIDEO),
        *(("recording", what, damage, TRACK) for what, damage in RECORDING),
        *(("actor", what, damage, TRACK) for what, damage in ACTOR_FILE),
        *(("example poses", what, damage, command) for what, damage, command in EXAMPLES),
        *(("motion", what, damage, command) for what, damage, command in MOTION),
        *(("configuration", word, nothing, (*TRACK, word)) for word in OPTIONS),
        *(("configuration", what, nothing, command) for what, command in COMMANDS),
        *(("files and rights", what, damage, command) for what, damage, command in FILES),
    ]
    return [BadInput(*row) for row in rows]


def huge_npz(folder: Path) -> None:
    """A motion whose header claims 10^9 joints."""
    header = io.BytesIO()
    claim = {"descr": "<f8", "fortran_order": False, "shape": (10, 10**9, 4, 4)}
    np.lib.format.write_array_header_1_0(header, claim)
    with np.load(folder / "motion.npz") as old:
        content = {name: old[name] for name in old.files if name != "world_from_joint"}
    np.savez(folder / "motion.npz", **content)
    with zipfile.ZipFile(folder / "motion.npz", "a") as file:
        file.writestr("world_from_joint.npy", header.getvalue())


def pickled(folder: Path) -> None:
    """A motion with an array of Python objects."""
    np.savez(folder / "motion.npz", fps=np.array([{"a": 1}], dtype=object))


def bomb(depth: int = 12) -> str:
    """YAML whose aliases unfold to 9^depth words."""
    lines = ["a0: &a0 [x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, depth)]
    return "\n".join(lines)


def frames_with_a_gap(folder: Path) -> None:
    """Pictures 0, 1 and 3 instead of a video."""
    (folder / "walk/videos/left.mp4").unlink()
    for frame in (0, 1, 3):
        picture(f"walk/images/left/{frame:06d}.png", 64, 48, 80)(folder)


CALIBRATION: list[tuple[str, Damage]] = [
    ("no file", gone(CAL)),
    ("empty file", write(CAL, "")),
    ("not text", write(CAL, bytes(range(256)) * 8)),
    ("a text of another kind", write(CAL, "Dear colleague, the cameras are calibrated.\n")),
    ("two files", lambda folder: (folder / "walk/other.toml").write_text((folder / CAL).read_text())),
    ("a bracket missing", edit(CAL, r"31\.5\], ", "31.5, ")),
    ("no matrix", edit(CAL, r"matrix.*\n", "")),
    ("a matrix of 2 rows", edit(CAL, r", \[0\.0, 0\.0, 1\.0\]\]", "]")),
    ("a word for a number", edit(CAL, "60.0", '"wide"')),
    ("a focal length of 0", edit(CAL, r"60\.0", "0.0")),
    ("a translation that is not finite", edit(CAL, r"3\.0\]", "nan]")),
    ("a reflection for a rotation", edit(CAL, r"rotation = .*", "rotation = [[1,0,0],[0,1,0],[0,0,-1]]")),
    ("a rotation of 2 numbers", edit(CAL, r"rotation = .*", "rotation = [0.1, 0.2]")),
    ("a size that is negative", edit(CAL, r"\[64, 48\]", "[64, -48]")),
    ("a size of 10^9 pixels a side", edit(CAL, r"\[64, 48\]", "[1000000000, 1000000000]")),
    ("three lens coefficients", edit(CAL, r"\[0\.0, 0\.0, 0\.0, 0\.0\]", "[0.0, 0.0, 0.0]")),
    ("one name twice", edit(CAL, r'name = "right"', 'name = "left"')),
    ("a name that is a path", edit(CAL, r'name = "right"', 'name = "../../right"')),
    ("a camera without video", edit(CAL, r'name = "right"', 'name = "cellar"')),
    ("a size that is not the video's", edit(CAL, r"\[64, 48\]", "[640, 480]")),
]

VIDEO: list[tuple[str, Damage]] = [
    ("one is missing", gone("walk/videos/left.mp4")),
    ("one more than cameras", video("walk/videos/cellar.mp4")),
    ("an empty file", write("walk/videos/left.mp4", "")),
    ("a text named .mp4", write("walk/videos/left.mp4", "no video at all\n" * 99)),
    ("the second half is missing", cut("walk/videos/left.mp4", 0.5)),
    ("another size", video("walk/videos/left.mp4", size=(96, 64))),
    ("another frame rate", video("walk/videos/left.mp4", fps=30.0)),
    ("pictures with a gap", frames_with_a_gap),
    ("an empty background that is no picture", write("walk/background/left.jpg", "no picture")),
    ("an empty background of another size", picture("walk/background/left.png", 32, 24, 80)),
]

RECORDING: list[tuple[str, Damage]] = [
    ("no YAML", write(REC, "up: [z\n")),
    ("a list", write(REC, "- up\n- z\n")),
    ("an unknown key", write(REC, "upp: z\n")),
    ("an unknown vertical", write(REC, "up: w\n")),
    ("an unknown unit", write(REC, "unit: feet\n")),
    ("a frame rate of 0", write(REC, "fps: 0\n")),
    ("a frame rate in words", write(REC, "fps: fast\n")),
    ("an unknown camera", write(REC, "cameras: [left, cellar]\n")),
    ("no cameras", write(REC, "cameras: []\n")),
    ("10^15 frames a second", write(REC, "fps: 1.0e+15\ntime_stamps: true\n")),
    ("a maybe for going by time stamps", write(REC, "time_stamps: maybe\n")),
    ("a number for going by time stamps", write(REC, "time_stamps: 2\n")),
    ("an offset of an unknown camera", write(REC, "frame_offset: {cellar: 2}\n")),
    ("an offset beyond the end", write(REC, "frame_offset: {left: 1000}\n")),
    ("the last frame before the first", write(REC, "first_frame: 3\nlast_frame: 1\n")),
    ("a calibration outside of the folder", write(REC, "calibration: ../../../etc/passwd\n")),
    ("an example pose outside of the folder", write(REC, "example_poses: [{name: ../../secret}]\n")),
    ("a Python object", write(REC, "fps: !!python/object/apply:os.getcwd []\n")),
    ("aliases that unfold to 10^11 words", write(REC, bomb())),
    ("brackets 10000 deep", write(REC, "up: " + "[" * 10000 + "]" * 10000)),
    ("a rough pose without place", write(POSE, "pose: rest\n")),
    ("a rough pose with an unknown name", write(POSE, "pose: flying\nposition: [0, 0, 1]\n")),
    ("a rough pose with unknown points", write(POSE, "landmarks: {tail: [0, 0, 1]}\n")),
    ("a rough pose that is not finite", write(POSE, "pose: rest\nposition: [0, .nan, 1]\n")),
]

ACTOR_FILE: list[tuple[str, Damage]] = [
    ("no file", gone(BODY)),
    ("empty file", write(BODY, "")),
    ("not text", write(BODY, bytes(range(256)) * 8)),
    ("no blobs", edit(BODY, r"(?s)blobs:.*landmarks", "landmarks")),
    ("an unknown parent", edit(BODY, "parent: root_yaw", "parent: nobody")),
    ("a cycle", edit(BODY, "parent: root_x,", "parent: waist,")),
    ("an unknown kind of joint", edit(BODY, "revolute", "ball")),
    ("an axis of length 0", edit(BODY, "axis: x", "axis: [0, 0, 0]")),
    ("a DoF of an unknown joint", edit(BODY, r"\{waist: 1", "{waste: 1")),
    ("limits the wrong way round", edit(BODY, r"\[-1, 1\]", "[1, -1]")),
    ("a blob on an unknown joint", edit(BODY, "trunk, joint: waist", "trunk, joint: waste")),
    ("a size of 0", edit(BODY, "sigma: 0.1", "sigma: 0")),
    ("a size that is not a number", edit(BODY, "sigma: 0.1", "sigma: big")),
    ("a colour beyond 1", edit(BODY, r"color: \[0\.2", "color: [20")),
    ("two joints of one name", edit(BODY, "name: root_y,", "name: root_x,")),
    ("no pose called rest", edit(BODY, "rest: ", "sleep: ")),
    ("a pose of an unknown DoF", edit(BODY, r"rest: \{\}", "rest: {tail: 1}")),
    ("a name that is a path", edit(BODY, "name: puppet", "name: ../../puppet")),
]

EXAMPLES: list[tuple[str, Damage, tuple[str, ...]]] = [
    ("a mask of another size", picture(f"{TPOSE}/left.mask.png", 32, 24, 255), ACTOR),
    ("an empty mask", picture(f"{TPOSE}/left.mask.png", 64, 48, 0), ACTOR),
    ("a full mask", picture(f"{TPOSE}/left.mask.png", 64, 48, 255), SEGMENT),
    ("a mask that is no picture", write(f"{TPOSE}/left.mask.png", "white"), SEGMENT),
    ("a picture of an unknown camera", picture(f"{TPOSE}/cellar.jpg", 64, 48, 9), SEGMENT),
    (
        "a subject that no example pose shows",
        write(REC, "up: z\nexample_poses: [{name: tpose, actor: anna}]\n"),
        (*SEGMENT, "subject=nobody"),
    ),
    ("a body that is not there", nothing, ("actor", "recording=walk", "body=lion", "out=new.yaml")),
]

MOTION: list[tuple[str, Damage, tuple[str, ...]]] = [
    ("no file", gone("motion.npz"), EXPORT),
    ("not an npz", write("motion.npz", "motion"), EXPORT),
    ("half a file", cut("motion.npz", 0.5), EXPORT),
    ("Python objects in it", pickled, EXPORT),
    ("an array is missing", arrays("motion.npz", world_from_joint=None), EXPORT),
    ("arrays of different length", arrays("motion.npz", energy=np.zeros(99)), EXPORT),
    ("a pose that is not finite", arrays("motion.npz", world_from_joint=np.full((4, 5, 4, 4), np.nan)), EVALUATE),
    ("10^9 joints in the header", huge_npz, EXPORT),
    ("a version of the future", arrays("motion.npz", format_version=np.array(999)), EXPORT),
    ("an ending that no format has", nothing, ("export", "motion=motion.npz", "to=new.doc")),
    ("a truth that is none", write("truth.npz", "truth"), EVALUATE),
    ("a truth of another rate", arrays("truth.npz", fps=np.array(60.0)), EVALUATE),
    ("a truth with names missing", arrays("truth.npz", marker_names=np.array(["shin"])), EVALUATE),
    ("a recording that is none", write("walk/calibration.toml", ""), VIEW),
]

OPTIONS = (
    "limit_weight=1",
    "energy.limit_weight=-1",
    "energy.limit_weight=nan",
    "energy.limit_weight=much",
    "energy.pairs=some",
    "energy.overlap_exponent=2",
    "solver=newton",
    "solver.epsilon=-0.002",
    "solver.max_iterations=0",
    "color.space=cmyk",
    "color.radius=0",
    "images.depth=99",
    "cameras=[cellar]",
    "cameras=[]",
    "start=9",
    "stop=99",
    "stop=soon",
    "initial_pose=nowhere.yaml",
    "images.background=pictures",
    "+new=1",
    "start",
)

COMMANDS: list[tuple[str, tuple[str, ...]]] = [
    ("an unknown command", ("trakc", "recording=walk")),
    ("no recording named", ("track", "actor=actor.yaml")),
    ("one actor for two people", ("track", "recording=walk", "actor=[actor.yaml,body.yaml]", "out=new/results")),
    ("a sweep over an unknown key", (*TRACK, "-m", "energy.weight=0,1")),
    ("a motion that synth does not know", ("synth", "out=new", "motion=fly")),
    ("pictures of odd width", ("synth", "out=new", "width=65")),
]

FILES: list[tuple[str, Damage, tuple[str, ...]]] = [
    ("no such recording", nothing, ("track", "recording=run", "out=new/results")),
    ("a file for the recording", nothing, ("track", "recording=actor.yaml", "out=new/results")),
    ("an empty folder for the recording", lambda folder: (folder / "run").mkdir(), ("track", "recording=run")),
    ("results below a file", nothing, ("track", "recording=walk", "actor=actor.yaml", "out=body.yaml/results")),
    ("results where nobody may write", nothing, ("track", "recording=walk", "actor=actor.yaml", "out=/proc/results")),
    ("an actor below a file", nothing, ("actor", "recording=walk", "body=body.yaml", "out=actor.yaml/a.yaml")),
    ("an export below a file", nothing, ("export", "motion=motion.npz", "to=actor.yaml/new.bvh")),
    ("a recording to be rendered that exists", nothing, ("synth", "out=walk")),
    (
        "a run's note that names the folder above",
        write("results/run.json", '{"command": "track", "files": [".."]}'),
        ("track", "recording=walk", "actor=actor.yaml", "out=results", "images.depth=99", "overwrite=true"),
    ),
    ("a folder for the actor", nothing, ("track", "recording=walk", "actor=walk", "out=new/results")),
]
