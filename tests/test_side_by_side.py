"""The runs of an experiment side by side: whose runs are taken, and what is said where there are none."""

from types import SimpleNamespace

import numpy as np
import pytest
import side_by_side
from tiny_body import make_body

from sogjax.errors import InputError
from sogjax.study.experiment import Experiment, ExperimentConfig, RowConfig
from sogjax.study.record import RunRecord
from sogjax.study.source import Source
from sogjax.study.study import Study

BODY = make_body()

OWN = RowConfig(synth={"motion": "pass", "actors": 2})
"""Of a recording of its own."""


@pytest.fixture
def shown(monkeypatch, tmp_path):
    """What is shown of an experiment that has a recording of its own, where some of its rows fail."""
    the_source = Source("walk-seed3", tmp_path, "", 2, tmp_path)
    the_source.__dict__ |= {"bodies": [BODY], "recording": SimpleNamespace(fps=30.0)}

    def of(failing, **rows):
        def run_row(experiment, row, source, *rest):
            assert source is the_source
            failed = "nobody is there" if row in failing else ""
            pose = np.zeros((2, BODY.skeleton.num_dofs)).tolist()
            numbers = {"frame": [0, 1], "error_mm": [10.0, 20.0], "iterations": [3, 4], "pose": pose}
            return RunRecord({}, "here", failed=failed, **numbers)

        monkeypatch.setattr(side_by_side, "run_row", run_row)
        config = ExperimentConfig(title="T", question="Q?", axis="x", reference="a", recordings=["walk:0"], rows=rows)
        study = Study(tmp_path, ["walk:3"], 2)
        return side_by_side.of_experiment(study, Experiment("small", config), the_source)

    return of


def test_only_rows_of_the_given_recording_are_shown(shown):
    motions, errors = shown(["c"], a=RowConfig(), b=OWN, c=RowConfig(), d=RowConfig())
    assert list(motions) == list(errors) == ["a", "d"]
    assert [motion.frame.tolist() for motion in motions["d"]] == [[0, 1]]
    np.testing.assert_allclose(errors["d"], [0.01, 0.02])


@pytest.mark.parametrize(
    ("row", "why"),
    [(RowConfig(), "nobody is there"), (OWN, "recordings of their own")],
)
def test_an_experiment_of_which_nothing_can_be_shown_is_refused(shown, row, why):
    with pytest.raises(InputError, match=rf"small: no row worked on walk-seed3 \(.*{why}\)"):
        shown(["a"], a=row)
