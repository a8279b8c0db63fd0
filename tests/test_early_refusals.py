"""Wrong keys and endings are refused before anything heavy is imported; and what the switches of outputs mean."""

import subprocess
import sys
from dataclasses import fields

import pytest
import yaml
from command_line import refused

from sogjax.cli.schemas import CALIBRATIONS, FORMATS, MOTIONS
from sogjax.cli.words import check_endings, composed
from sogjax.errors import InputError
from sogjax.io.export.write import WRITERS
from sogjax.run.adjust import kept_config
from sogjax.run.initial_pose import NAMES
from sogjax.settings.compose import REMOVED, track_config
from sogjax.settings.option import help_lines, telling_settings
from sogjax.settings.run import OutputsConfig, TrackConfig


def test_the_endings_are_those_of_the_writers():
    assert {*WRITERS} | {".motion", ".yaml", ".yml"} == {*MOTIONS}
    assert {f".{name}" for name in FORMATS} == {*WRITERS} - {".npz"}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("export", "motion=m.npz", "to=a.fbx"), ".bvh"),
        (("export", "calibration=c.toml", "to=a.bvh"), CALIBRATIONS[0]),
        (("view", "motion=m", "recording=r", "out=a.mp4"), ".rrd .png"),
        (("track", "recording=r", "outputs.formats=[fbx]"), "trc"),
        (("track", "recording=r", "foo=1"), "foo"),
    ],
)
def test_a_wrong_word_is_refused_when_the_settings_are_composed(words, said):
    with pytest.raises(InputError) as refused:
        composed(words[0], list(words[1:]))
    assert said in str(refused.value)


def test_nothing_heavy_is_imported_before():
    look = (
        "import sys\n"
        "from sogjax.cli.main import main\n"
        "assert main(['export', 'motion=m.npz', 'to=a.fbx']) == 2\n"
        "heavy = {'jax', 'cv2', 'rerun', 'scipy'} & set(sys.modules)\n"
        "sys.exit(f'imported: {heavy}' if heavy else 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(("word", "shown"), [("images=false", False), ("images=true", True)])
def test_an_option_with_the_name_of_a_config_group(word, shown):
    config = composed("view", ["motion=m", "recording=r", "out=a.rrd", word])
    assert (config.images, config.out) == (shown, "a.rrd")
    assert composed("track", ["recording=r", "images=grid"]).images.box_around


def test_a_wrong_value_for_it_is_one_sentence():
    with pytest.raises(InputError, match="images"):
        composed("view", ["motion=m", "recording=r", "out=a.rrd", "images=maybe"])


@pytest.mark.parametrize("key", [*REMOVED])
def test_a_setting_that_there_was_once_is_refused_with_the_reason(capsys, key):
    words = ("actor", "out=a.yaml") if key == "energy" else ("track",)
    value = ".capped=true" if key == "energy" else "=1"
    assert refused(capsys, *words, "recording=r", f"{key}{value}").startswith(
        f"sogjax: {key}: is not a setting any more: "
    )


def test_the_configuration_of_an_older_run_is_read_without_what_is_no_setting_any_more(tmp_path):
    old = {"solver": {"method": "lbfgs", "grow": 1.2}, "tracking": {"repair": False}, "outputs": {"worst": True}}
    (tmp_path / "config.yaml").write_text(yaml.safe_dump({"recording": "r", "stop": 9} | old))
    assert kept_config(tmp_path / "config.yaml") == track_config(recording="r", stop=9, solver={"method": "lbfgs"})


def test_the_help_tells_the_names_that_an_initial_pose_can_have():
    (text,) = [line.text for line in help_lines(TrackConfig) if line.key == "initial_pose"]
    assert all(f"{name}: " in text for name in NAMES)


def test_one_switch_for_the_motion_only():
    asked = track_config(["outputs.motion_only=true"], recording="r").outputs.asked()
    assert (asked.overlay, asked.rerun, asked.bvh, asked.formats) == (False, False, False, None)
    assert OutputsConfig().asked().overlay
    check_endings("track", track_config(recording="r"))


def test_without_files_what_belongs_to_the_motion_is_kept():
    asked = OutputsConfig(motion_only=True, confidence=False, formats=["c3d"]).asked()
    assert (asked.confidence, asked.formats) == (False, None)
    assert OutputsConfig(motion_only=True).asked().confidence
    files = {"motion_only", "page", "overlay", "overlay_width", "rerun", "rerun_images", "bvh", "formats", "pose2sim"}
    telling = {key.removeprefix("outputs.") for key in telling_settings(TrackConfig()) if key.startswith("outputs.")}
    assert telling == {entry.name for entry in fields(OutputsConfig)} - files
