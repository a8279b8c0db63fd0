"""`sogjax doctor`: everything is said, the laws of its self-test can fail, and trouble is an exit status."""

import pytest
from command_line import done, refused

from sogjax.cli import doctor
from sogjax.cli import doctor as self_test
from sogjax.run.compilation_cache import REFUSED, VARIABLE, programs_folder


def test_a_sound_installation(capsys, tmp_path):
    out, err = done(capsys, "doctor", f"folder={tmp_path}")
    for word in ("python", "jax", "opencv-python-headless", "devices", "extra [test]", str(tmp_path), "MB/s"):
        assert word in out
    assert out.count("right (") == len(self_test.LAWS)
    assert out.splitlines()[-1] == "everything works"
    assert err == ""


def test_a_folder_that_cannot_be_written_is_trouble(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(doctor, "LAWS", {})
    missing = tmp_path / "missing"
    with pytest.raises(doctor.InputError, match="cannot be written"):
        doctor.run(doctor.DoctorConfig(folder=str(missing)))


def test_why_programs_are_not_kept_is_told_with_the_file_that_says_so(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(doctor, "LAWS", {})
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    folder = programs_folder()
    folder.mkdir()
    (folder / REFUSED).write_text("Loading XLA:CPU AOT result. A feature is missing.\nand so on")
    doctor.say_programs(None)
    (line,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("compiled programs"))
    assert str(folder / REFUSED) in line
    assert "A feature is missing. and so on" in line


def test_a_law_that_is_broken_is_trouble(capsys, monkeypatch):
    monkeypatch.setattr(doctor, "LAWS", {"broken": lambda: "1 is 2", "raising": lambda: 1 / 0})
    with pytest.raises(doctor.InputError, match=r"2 found: broken: 1 is 2.*raising: ZeroDivisionError"):
        doctor.run(doctor.DoctorConfig())


def test_the_overlap_law_notices_the_printed_exponent(monkeypatch):
    monkeypatch.setattr(self_test, "overlaps", lambda a, b, c, exponent: overlaps(a, b, c, 2.0 * exponent))
    assert "integral" in (self_test.overlap_is_the_integral() or "")


overlaps = self_test.overlaps


def test_unknown_options_are_refused(capsys):
    assert "quick" in refused(capsys, "doctor", "quick=true")
