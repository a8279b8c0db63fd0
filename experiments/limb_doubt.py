"""Is a limb that is in doubt lost, and one that is not in its place?

    python experiments/limb_doubt.py [cameras=[4,12]] [backgrounds=[pictures,clip,none]] [sequences=[walk,run]]
        [write=true]

The yardstick sequences are tracked as recorded, with two of three frames left out, and with each limb displaced by 20
to 30 cm on purpose, for 10 frames each. A limb is lost if its joints are more than 10 cm off on average. With
`write=true` the weights that come from all sequences are written into `sogjax/quality/fitted.yaml`; in the tables and
the picture every other sequence is judged by weights that come from the rest. Trials that were made are kept, and not
made again by the same program. Writes `limb_doubt.png`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import yaml
from jaxtyping import Float
from scipy.optimize import minimize
from scipy.special import expit, logit

from sogjax.errors import InputError
from sogjax.io.files import atomic_path, write_file
from sogjax.quality.fitted import PATH, Weights
from sogjax.quality.limb_confidence import FAR
from sogjax.run.memory import forget_programs_if_many
from sogjax.study.experiment import yardsticks
from sogjax.study.limb_calibration import (
    WeightsOf,
    area_table,
    calibration_table,
    committed,
    limb_curve,
    lost,
    said_of,
)
from sogjax.study.limb_trials import FOLLOWED, PLAIN, JudgedLimb, LimbTrial, LimbTrials
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.study.study import Study
from sogjax.study.table import ruled_table
from sogjax.view.charts import limb_chart

RIDGE = 1e-4
ON_BACKGROUND = 0.7
"""How likely a limb is lost at least that lies on nothing but background, where one is known: of a subject in one
colour, colours tell nothing."""


def fitted_weights(limbs: Sequence[JudgedLimb]) -> Weights:
    """The weights that suit some limbs best (maximum likelihood, with a little of a ridge); no measure may reassure."""
    rows = np.concatenate([np.stack([np.ones_like(limb.worse), limb.worse, limb.contradicted]) for limb in limbs], 1)
    sign = np.where(lost(limbs), 1.0, -1.0)

    def loss(weights: Float[np.ndarray, "3"]) -> tuple[float, Float[np.ndarray, "3"]]:
        margin = sign * (weights @ rows)
        value = np.mean(np.logaddexp(0.0, -margin)) + RIDGE * np.sum(weights[1:] ** 2)
        return float(value), -rows @ (sign * expit(-margin)) / len(sign) + 2.0 * RIDGE * np.array(
            [0.0, 1.0, 1.0]
        ) * weights

    bounds = [(None, None), (0.0, None), (0.0, None)]
    contradicted = {"type": "ineq", "fun": lambda weights: weights[0] + weights[2] - logit(ON_BACKGROUND)}
    constraints = [contradicted] if any(_known(limb) for limb in limbs) else []
    found = minimize(loss, np.zeros(3), jac=True, bounds=bounds, constraints=constraints, method="SLSQP")
    return Weights(*found.x.tolist())


def write_weights(path: Path, found: Mapping[str, Sequence[JudgedLimb]], trials: str) -> None:
    """Write weights that were fitted to limbs into the file of fitted numbers, rounded to one decimal.

    Args:
        path: the file.
        found: the limbs to fit to, by `with_background` and `without_background`; what is absent keeps its weights.
        trials: what was tracked, which the file will say.
    """
    counts = [f"{name}: {len(lost(limbs))} limbs, {int(lost(limbs).sum())} lost" for name, limbs in found.items()]

    def refit(part: dict) -> None:
        for name, limbs in found.items():
            part["values"][name] = {key: round(value, 1) + 0.0 for key, value in asdict(fitted_weights(limbs)).items()}
        others = [said for said in part["recordings"].split("; ") if said.split(":")[0] in {*part["values"]} - {*found}]
        part["recordings"] = "; ".join([trials, *counts, *others])

    change_part(path, "limb_weights", refit)


def change_part(path: Path, name: str, change: Callable[[dict], None]) -> None:
    """Change a part of the file of fitted numbers."""
    text = path.read_text(encoding="utf-8")
    content = yaml.safe_load(text)
    change(content[name])
    header = "".join(line for line in text.splitlines(keepends=True) if line.startswith("#"))
    with atomic_path(path) as temporary:
        written = yaml.safe_dump(content, sort_keys=False, width=120, allow_unicode=True, default_flow_style=None)
        temporary.write_text(header + written, encoding="utf-8")


def regained_table(
    limbs: Sequence[JudgedLimb], groups: dict[str, Callable[[JudgedLimb], bool]], weights: WeightsOf = committed
) -> str:
    """How many limbs that were displaced on purpose came back by themselves, and how many others were noticed."""
    lines = [["", "displaced", f"back after {FOLLOWED} frames", "of the others in doubt then"]]
    for name, belongs in groups.items():
        group = [limb for limb in limbs if limb.kind == f"{limb.name} displaced" and belongs(limb)]
        if group:
            left = [limb for limb in group if limb.error[-1] > FAR]
            noticed = [said_of([limb], weights)[0][-1] > 0.5 for limb in left]
            back = f"{100.0 * (1.0 - len(left) / len(group)):.1f} %"
            lines.append([name, str(len(group)), back, f"{100.0 * np.mean(noticed):.0f} %" if left else ""])
    return ruled_table(lines)


@dataclass
class Settings:
    """What is tracked, as `key=value` on the command line."""

    sequences: list[str] = field(default_factory=list)
    """Rows of the experiment; none: all."""
    cameras: list[int] = field(default_factory=lambda: [4, 12])
    backgrounds: list[str] = field(default_factory=lambda: ["pictures", "clip", "none"])
    frames: int = 60
    do: bool = True
    """Whether trials that are missing are made."""
    write: bool = False
    """Whether the fitted weights are written into the package's file of fitted numbers."""
    body: str = "human"
    overrides: list[str] = field(default_factory=list)
    """Of track."""
    out: str = "outputs/limb_doubt"
    """Where trials, actors and results are kept."""


def main() -> None:
    """Track, print the tables, and write the picture."""
    settings = settings_from(Settings)
    names, found = yardsticks(settings.sequences), []
    trials = LimbTrials(Study(Path(settings.out), ["walk:0"], settings.frames, body=settings.body), settings.overrides)
    for sequence, synth in names.items():
        for cameras in settings.cameras:
            for background in settings.backgrounds:
                forget_programs_if_many()
                found += trials.of(LimbTrial(sequence, synth, cameras, background), settings.do)
    if not found:
        raise InputError("no trial was made; do=true makes them")
    _print(found, [*names], settings)
    if settings.write:
        known = {"with_background": True, "without_background": False}
        groups = {name: [limb for limb in found if _known(limb) == has] for name, has in known.items()}
        write_weights(PATH, {name: group for name, group in groups.items() if group}, _trials(settings))
        print(PATH)


def _known(limb: JudgedLimb) -> bool:
    """Whether a background was known."""
    return limb.trial.background != "none"


def _trials(settings: Settings) -> str:
    """What was tracked, in a line."""
    sequences = ", ".join(settings.sequences) or "all yardstick sequences"
    cameras, backgrounds = ", ".join(map(str, settings.cameras)), ", ".join(settings.backgrounds)
    return f"{sequences}; {cameras} cameras; background: {backgrounds}; {settings.frames} frames"


def _print(found: list[JudgedLimb], names: list[str], settings: Settings) -> None:
    """The weights, the tables and the picture."""
    half = lambda limb: names.index(limb.trial.sequence) % 2
    weights: dict[tuple[int, bool], Weights] = {}
    print(machine_line())
    for has in sorted({_known(limb) for limb in found}, reverse=True):
        group = [limb for limb in found if _known(limb) == has]
        print(f"{'with a background' if has else 'without'}: {fitted_weights(group)}")
        for number in (0, 1):
            rest = [limb for limb in group if half(limb) != number]
            weights[number, has] = fitted_weights(rest or group)
            print(f"    for half {number}: {weights[number, has]}")
    of_rest = lambda limb: weights[half(limb), _known(limb)]
    settings_of = {
        f"{cameras} cameras, {background}": lambda limb, c=cameras, b=background: (
            (limb.trial.cameras, limb.trial.background) == (c, b)
        )
        for cameras in settings.cameras
        for background in settings.backgrounds
    }
    kinds = {
        "with a background": lambda limb: _known(limb),
        "without": lambda limb: not _known(limb),
        "with a background, as recorded": lambda limb: _known(limb) and limb.kind == PLAIN,
        "without, as recorded": lambda limb: not _known(limb) and limb.kind == PLAIN,
    }
    sequences = {name: lambda limb, n=name: limb.trial.sequence == n and _known(limb) for name in names}
    for title, groups in (("Areas under the ROC", kinds | settings_of), ("With a background", sequences)):
        print(f"\n{title}:\n", area_table(found, groups, of_rest), sep="\n")
    print("\nLimbs displaced by 20 to 30 cm:\n", regained_table(found, kinds | settings_of, of_rest), sep="\n")
    curves = {}
    for title in ("with a background", "without"):
        if group := [limb for limb in found if kinds[title](limb)]:
            print(f"\nSaid and found, {title}:\n", calibration_table(group, of_rest), sep="\n")
            curves[title] = limb_curve(group, of_rest)
    path = Path(settings.out) / "limb_doubt.png"
    write_file(path, limb_chart(curves))
    print(f"\n{path}")


if __name__ == "__main__":
    run_script(main)
