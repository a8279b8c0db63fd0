"""The register of a recording's files."""

from pathlib import Path

import numpy as np
import pytest
from small_recording import make_recording, write_image

from sogjax.errors import InputError
from sogjax.io.recording_files import GROUND_TRUTH, RECORDING_FILES, files_of, folder_around

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("part", RECORDING_FILES, ids=lambda part: part.name)
def test_the_guide_names_every_file(part):
    name = f"{part.name}/" if part.is_folder else part.name
    assert any(name in page.read_text() for page in [ROOT / "README.md", *ROOT.glob("docs/guide/*.md")])


def test_files_of_a_recording_are_its_own_and_those_of_its_folders(tmp_path):
    folder = make_recording(tmp_path / "walk", ("left",))
    write_image(folder / "example_poses" / "t" / "left.png", np.zeros((2, 2, 3), np.uint8))
    write_image(folder / "results" / "overlay.png", np.zeros((2, 2, 3), np.uint8))
    found = {str(path.relative_to(folder)) for path in files_of(folder)}
    assert found == {"calibration.toml", "recording.yaml", "videos/left.mp4", "example_poses/t/left.png"}


def test_the_folder_around_a_part_is_told(tmp_path):
    folder = make_recording(tmp_path / "walk", ("left",))
    for inside in ("videos", "recording.yaml"):
        assert str(folder) in folder_around(folder / inside)
    assert folder_around(tmp_path) == ""


def test_a_damaged_file_is_refused_and_one_that_is_not_there_is_none(tmp_path):
    assert GROUND_TRUTH.checked(tmp_path) is None
    GROUND_TRUTH.of(tmp_path).write_text("no arrays")
    with pytest.raises(InputError, match=r"ground_truth\.npz"):
        GROUND_TRUTH.checked(tmp_path)
