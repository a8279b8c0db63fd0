"""`sogjax evaluate`: compare motions with ground truth."""

from pathlib import Path
from typing import TypeVar

from sogjax.cli.schemas import EvaluateConfig
from sogjax.errors import InputError
from sogjax.io.frame_motions import load_motions, load_one_motion
from sogjax.io.ground_truth import GroundTruth, load_ground_truth
from sogjax.io.motion import Motion
from sogjax.io.recording_files import GROUND_TRUTH
from sogjax.io.reference.load import READERS, is_reference, load_reference
from sogjax.quality.evaluation import GroupEvaluation, evaluate_motions
from sogjax.quality.reference.evaluation import ReferenceEvaluation, evaluate_against_reference
from sogjax.run.build import marker_rule
from sogjax.run.recordings import file_list
from sogjax.run.run_folder import free_path

Found = TypeVar("Found", GroupEvaluation, ReferenceEvaluation)


def run(config: EvaluateConfig) -> GroupEvaluation | ReferenceEvaluation:
    """Print the table; write the JSON file on request.

    Raises:
        InputError: files that cannot be opened or do not match, or an existing file for the metrics.
    """
    out = None if config.out is None else free_path("out", config.out, config.overwrite)
    rule = marker_rule(config.markers, "markers")
    if is_reference(Path(config.truth)):
        return _printed(_against_reference(config), out)
    if config.offset is not None:
        raise InputError(f"offset={config.offset}: only for another system's {' '.join(READERS)}; leave it out")
    truth = load_ground_truth(truth_file(Path(config.truth)))
    evaluation = evaluate_motions(named_motions(file_list(config.motion), truth), truth, rule=rule)
    return _printed(evaluation, out)


def _printed(evaluation: Found, out: Path | None) -> Found:
    print(evaluation.table())
    if out is not None:
        evaluation.to_json(out)
        print(out)
    return evaluation


def _against_reference(config: EvaluateConfig) -> ReferenceEvaluation:
    """The comparison of one motion with another system's."""
    paths = file_list(config.motion)
    motions = [motion for path in paths for motion in _by_name(path).values()]
    if len(motions) != 1:
        raise InputError(f"truth={config.truth}: is of one person; give one motion_NAME.npz")
    return evaluate_against_reference(motions[0], load_reference(Path(config.truth)), config.offset)


def truth_file(path: Path) -> Path:
    """The file of a truth, which may be given as its recording's folder.

    Raises:
        InputError: the folder has none.
    """
    if not path.is_dir():
        return path
    truth = GROUND_TRUTH.of(path)
    if not truth.is_file():
        raise InputError(
            f"truth={path}: this folder holds no ground_truth.npz; give that file, or a recording that has one"
        )
    return truth


def named_motions(paths: list[Path], truth: GroundTruth) -> dict[str, Motion]:
    """The motions by actor: `motion_NAME.npz` is NAME's if the truth has several subjects.

    Raises:
        InputError: a motion whose file name is that of no subject of the truth.
    """
    found = [(path, *named) for path in paths for named in _by_name(path).items()]
    if len(found) == 1 and len(truth.subjects) < 2:
        return {next(iter(truth.subjects), found[0][1]): found[0][2]}
    if not truth.subjects:
        raise InputError(f"motion={','.join(map(str, paths))}: the truth is that of one subject; give one motion")
    for path, name, _ in found:
        if name not in truth.subjects:
            raise InputError(
                f"{path}: the truth's subjects are {', '.join(truth.subjects)}; name the file motion_NAME.npz after one"
            )
    return {name: motion for _, name, motion in found}


def _by_name(path: Path) -> dict[str, Motion]:
    """The motions of a run's folder by actor; that of a file by what the file's name says or, without, the file."""
    if path.is_dir() or path.stem == "motion":
        return load_motions(path)
    return {path.stem.removeprefix("motion_"): load_one_motion(path)}
