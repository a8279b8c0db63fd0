"""Files from elsewhere: no name leads out of a folder, no header takes memory that the file does not fill, no code."""

import io
import struct
import tracemalloc
import zipfile
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from command_line import actor_file, refused, trackable
from small_recording import make_recording, snapshot, toml_camera, write_calibration, write_image

from sogjax.errors import InputError
from sogjax.io import yaml_entry
from sogjax.io.actor_file import load_body
from sogjax.io.array_log import CONSTANT, ROWS, read_log
from sogjax.io.calibration.load import load_calibration
from sogjax.io.files import objection
from sogjax.io.image_file import claimed_size, read_image
from sogjax.io.npz_file import read_npz
from sogjax.io.recording import open_recording
from sogjax.io.yaml_entry import _FastLoader, read_yaml

LEADING_OUT = ("../../x", "..", "a/b", "/etc/passwd", "..\\x", "a\0b", "x" * 300, ".hidden", "a\nb", "é" * 80)
PLAIN = ("cam01", "left camera", "Kamera (1)", "カメラ1", "a.b-c_d")


@pytest.mark.parametrize("name", LEADING_OUT)
def test_names_that_lead_out_of_a_folder_are_refused_wherever_they_stand(tmp_path, name):
    assert objection(name)
    quoted = yaml.safe_dump(name, default_flow_style=True, width=10**6).removesuffix("\n...\n").strip()
    escaped = '"' + "".join(f"\\U{ord(c):08x}" for c in name) + '"'
    calibration = write_calibration(tmp_path, toml_camera("a", name=escaped))
    with pytest.raises(InputError, match="camera"):
        load_calibration(calibration)

    recording = make_recording(tmp_path / "walk")
    for settings in (
        f"example_poses: [{{name: {quoted}}}]",
        f"example_poses: [{{name: tpose, actor: {quoted}}}]",
        f"calibration: {quoted}",
    ):
        (recording / "recording.yaml").write_text(f"up: z\n{settings}\n", encoding="utf-8")
        with pytest.raises(InputError, match=r"recording\.yaml"):
            open_recording(recording)

    actor = actor_file(tmp_path / "actor.yaml", lambda content: content.update(name=name))
    with pytest.raises(InputError, match="name"):
        load_body(actor)


@pytest.mark.parametrize("name", PLAIN)
def test_plain_names_are_taken(tmp_path, name):
    assert objection(name) is None
    recording = make_recording(tmp_path / "walk", cameras=("left", "right"))
    write_calibration(recording, toml_camera("left"), toml_camera("b", name=f'"{name}"'))
    (recording / "videos" / "right.mp4").rename(recording / "videos" / f"{name}.mp4")
    assert open_recording(recording).rig.names == ("left", name)


def test_no_command_writes_beside_its_folder_when_names_lead_out_of_it(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recording = trackable(tmp_path / "in" / "walk")
    for camera in ("left", "right"):
        write_image(recording / "example_poses" / "tpose" / f"{camera}.jpg", np.full((48, 64, 3), 90, np.uint8))
        write_image(recording / f"{camera}.jpg", np.full((48, 64, 3), 90, np.uint8))
    (recording / "recording.yaml").write_text("up: z\nexample_poses: [{name: ..}]\n")
    before = snapshot(tmp_path)
    for words in (["segment", "out=deep/masks"], ["track", "out=deep/results"], ["actor", "out=deep/actor.yaml"]):
        refused(capsys, words[0], f"recording={recording}", *words[1:])
    assert snapshot(tmp_path) == before


def npy(shape, descr="<f8", content=b""):
    """The bytes of a npy file that claims a shape and holds `content`."""
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": descr, "fortran_order": False, "shape": shape})
    return file.getvalue() + content


@pytest.mark.parametrize(
    ("shape", "descr"), [((10**9,), "<f8"), ((10**6, 10**6, 10**6), "<f8"), ((3,), "<U100000000"), ((1 << 62,), "|u1")]
)
def test_a_header_that_claims_too_much_is_refused_before_memory_is_taken(tmp_path, shape, descr):
    path = tmp_path / "motion.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("joint_names.npy", npy(shape, descr, b"x" * 100))
    with pytest.raises(InputError, match="claims"):
        read_npz(path)


@pytest.mark.parametrize(("shape", "descr"), [((10**9,), "<f8"), ((3,), "<U100000000"), ((1 << 62,), "|u1")])
def test_of_a_log_that_claims_too_much_no_more_is_taken_than_is_there(tmp_path, shape, descr):
    """After a loss of power the header may count rows that were not written."""
    folder = tmp_path / "motion.partial"
    folder.mkdir()
    np.savez(folder / CONSTANT, fps=30.0)
    row = [("number", descr)]
    (folder / ROWS).write_bytes(npy(shape, row, b"\0" * 800))
    tracemalloc.start()
    arrays = read_log(folder)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert arrays["number"].nbytes <= 800
    assert most < 2**22


class Exploding:
    """Would write a file if it were unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (open, (str(self.path), "w"))


def test_pickles_are_not_opened(tmp_path):
    trap = tmp_path / "trap"
    np.savez(tmp_path / "a.npz", fps=np.array([Exploding(trap)], object))
    with pytest.raises(InputError, match="pickle"):
        read_npz(tmp_path / "a.npz")
    assert not trap.exists()


def png_header(width, height):
    """A png that claims a size and holds one byte."""
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"\0")) + chunk(b"IEND", b"")


def jpeg_header(width, height):
    """A small jpg whose frame header claims a size."""
    encoded = cv2.imencode(".jpg", np.zeros((16, 16, 3), np.uint8))[1].tobytes()
    place = encoded.index(b"\xff\xc0") + 5
    return encoded[:place] + struct.pack(">HH", height, width) + encoded[place + 4 :]


@pytest.mark.parametrize(
    "content", [png_header(100_000, 100_000), jpeg_header(65_000, 65_000), png_header(20_000, 9_000)]
)
def test_a_picture_that_claims_too_many_pixels_is_refused(tmp_path, content):
    path = tmp_path / "left.jpg"
    path.write_bytes(content)
    with pytest.raises(InputError, match="pixels"):
        read_image(path)


@pytest.mark.parametrize("ending", [".png", ".jpg"])
@pytest.mark.parametrize("quality", [[], [cv2.IMWRITE_JPEG_PROGRESSIVE, 1]])
def test_the_size_in_a_header_is_the_pictures(ending, quality):
    image = np.random.default_rng(0).integers(0, 255, (37, 53, 3), np.uint8)
    encoded = cv2.imencode(ending, image, quality if ending == ".jpg" else [])[1].tobytes()
    assert claimed_size(encoded) == (53, 37)
    assert claimed_size(encoded[:10]) == (0, 0)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("a: &a [x,x,x,x,x]\nb: &b [*a,*a,*a,*a,*a]\nc: &c [*b,*b,*b,*b,*b]\n", "aliases"),
        ("[" * 50_000, "YAML|deep"),
        ("- " * 50_000 + "x", "YAML|deep"),
        ("{a: " * 20_000 + "1" + "}" * 20_000, "YAML|deep"),
        ("x: !!python/object/apply:os.system [echo]\n", "YAML"),
        ("a: " + "x" * 1_000_001, "larger"),
    ],
)
def test_yaml_that_would_grow_or_run_is_refused(tmp_path, text, word):
    path = tmp_path / "recording.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=word):
        read_yaml(path)


def test_an_actor_with_too_many_joints_is_refused(tmp_path):
    row = {"parent": "world", "axis": "x", "kind": "revolute"}
    many = [{**row, "name": f"j{k}", "offset": [0, 0, 0]} for k in range(2001)]
    path = actor_file(tmp_path / "actor.yaml", lambda content: content.update(joints=many))
    with pytest.raises(InputError, match="2001 rows"):
        load_body(path)


def test_a_video_that_claims_too_many_pixels_is_refused(tmp_path, monkeypatch):
    from sogjax.io import video_file

    recording = make_recording(tmp_path / "walk")
    monkeypatch.setattr(video_file, "MAX_PIXELS", 64 * 48 - 1)
    with pytest.raises(InputError, match="64x48 pixels"):
        open_recording(recording)


@pytest.mark.parametrize("levels", [90, 300, 480, 900, 20000])
def test_deep_yaml_is_read_or_refused(tmp_path, levels):
    path = tmp_path / "recording.yaml"
    path.write_text(f"version: {'[' * levels}{']' * levels}")
    with pytest.raises(InputError, match=r"recording.yaml: (.*expected|is nested too deeply)"):
        read_yaml(path).mapping()["version"].text()


def test_both_readers_of_yaml_say_the_same(tmp_path, monkeypatch):
    if not yaml.__with_libyaml__:
        pytest.skip("PyYAML was built without libyaml")
    files = [actor_file(tmp_path / "actor.yaml"), *(Path(yaml_entry.__file__).parent / "bodies").glob("*.yaml")]
    assert len(files) > 1
    fast = [read_yaml(path).value for path in files]
    monkeypatch.setattr(yaml, "__with_libyaml__", False)
    assert fast == [read_yaml(path).value for path in files]


@pytest.mark.parametrize("text", ["a: &a [1]\nb: *a", "a: &a x\nb: *a", "a: &a\nb: *a", "a: &a [*a]", "a: 1\na: 2"])
def test_the_fast_reader_takes_neither_aliases_nor_keys_twice(text):
    with pytest.raises(yaml.YAMLError):
        yaml.load(text, Loader=_FastLoader)
