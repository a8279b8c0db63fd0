"""The script that writes runs side by side: whose runs it takes, and what it says where there are none."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tiny_body import make_body

sys.path.append(str(Path(__file__).parents[1] / "experiments"))

import side_by_side

from sogjax.errors import InputError
from sogjax.study.experiment import Experiment, ExperimentConfig, RowConfig
from sogjax.study.record import RunRecord

BODY = make_body()
SOURCE = SimpleNamespace(name="walk-seed3", bodies=[BODY], recording=SimpleNamespace(fps=30.0))
STUDY = SimpleNamespace(runs=None, overrides=())


def shown(monkeypatch, failing, **rows):
    """What is shown of an experiment that has a recording of its own, where some of its rows fail."""

    def run_row(experiment, row, source, *rest):
        assert source is SOURCE
        failed = "nobody is there" if row in failing else ""
        pose = np.zeros((2, BODY.skeleton.num_dofs)).tolist()
        return RunRecord({}, "here", frame=[0, 1], error_mm=[10.0, 20.0], iterations=[3, 4], pose=pose, failed=failed)

    monkeypatch.setattr(side_by_side, "run_row", run_row)
    config = ExperimentConfig(title="T", question="Q?", axis="x", reference="a", recordings=["walk:0"], rows=rows)
    return side_by_side.of_experiment(STUDY, Experiment("small", config), SOURCE)


def test_only_rows_of_the_given_recording_are_shown(monkeypatch):
    motions, errors = shown(monkeypatch, ["c"], a=RowConfig(), b=RowConfig(actors=2), c=RowConfig(), d=RowConfig())
    assert list(motions) == list(errors) == ["a", "d"]
    assert [motion.frame.tolist() for motion in motions["d"]] == [[0, 1]]
    np.testing.assert_allclose(errors["d"], [0.01, 0.02])


@pytest.mark.parametrize(("row", "why"), [(RowConfig(), "nobody is there"), (RowConfig(actors=2), "several people")])
def test_an_experiment_of_which_nothing_can_be_shown_is_refused(monkeypatch, row, why):
    with pytest.raises(InputError, match=rf"small: no row worked on walk-seed3 \(.*{why}\)"):
        shown(monkeypatch, ["a"], a=row)
