"""Is a limb that is in doubt lost, and one that is not in its place?

    python experiments/limb_doubt.py [cameras=[4,12]] [backgrounds=[pictures,clip,none]] [sequences=[walk,run]]
        [write=true]

The yardstick sequences are tracked as recorded, with two of three frames left out, and with each limb displaced by 20
to 30 cm on purpose, for 10 frames each. A limb is lost if its joints are more than 10 cm off on average. With
`write=true` the weights that come from all sequences are written into `sogjax/quality/fitted.yaml`; in the tables and
the picture every other sequence is judged by weights that come from the rest. Trials that were made are kept, and not
made again by the same program. Writes `limb_doubt.png`.
"""

from dataclasses import dataclass, field
from pathlib import Path

from sogjax.errors import InputError
from sogjax.io.files import write_file
from sogjax.quality.fitted import PATH, Weights
from sogjax.run.memory import forget_programs_if_many
from sogjax.study.experiment import yardsticks
from sogjax.study.limb_calibration import (
    area_table,
    calibration_table,
    fitted_weights,
    limb_curve,
    regained_table,
    write_weights,
)
from sogjax.study.limb_trials import PLAIN, JudgedLimb, LimbTrial, LimbTrials
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.study.study import Study
from sogjax.view.charts import limb_chart


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
