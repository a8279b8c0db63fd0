"""Does a limb that was put elsewhere come back, with repair and without?

    python experiments/cut_limbs.py [cameras=[4,12]] [backgrounds=[pictures]] [sequences=[walk,run]]

Each limb in turn is displaced by 20 to 30 cm in two frames of every yardstick sequence; it is back if its joints are
within 10 cm of the truth ten frames later. The tables of sequences as they are show whether repair does any harm.
Trials that were made are kept, and not made again by the same program.
"""

from dataclasses import dataclass, field
from pathlib import Path

from sogjax.engine.compiled_programs import forget_programs_if_many
from sogjax.study.experiment import yardsticks
from sogjax.study.limb_calibration import area_table, regained_table
from sogjax.study.limb_trials import PLAIN, SKIPPING, JudgedLimb, LimbTrial, LimbTrials
from sogjax.study.machine import machine_line
from sogjax.study.script import run_script, settings_from
from sogjax.study.study import Study

METHODS = {"without repair": [], "with repair": ["tracking.repair=true"]}


@dataclass
class Settings:
    """What is tracked, as `key=value` on the command line."""

    sequences: list[str] = field(default_factory=list)
    """Rows of the experiment `sequences`; none: all."""
    cameras: list[int] = field(default_factory=lambda: [4, 12])
    backgrounds: list[str] = field(default_factory=lambda: ["pictures"])
    frames: int = 60
    do: bool = True
    """Whether trials that are missing are made."""
    body: str = "human"
    out: str = "outputs/limb_doubt"
    """Where trials, actors and results are kept."""


def main() -> None:
    """Track with either method, and print the tables."""
    settings = settings_from(Settings)
    recordings = yardsticks(settings.sequences)
    study = Study(Path(settings.out), ["walk:0"], settings.frames, body=settings.body)
    found: dict[str, list[JudgedLimb]] = {method: [] for method in METHODS}
    for name, synth in recordings.items():
        for cameras in settings.cameras:
            for background in settings.backgrounds:
                trial = LimbTrial(name, synth, cameras, background)
                forget_programs_if_many()
                tracked = [LimbTrials(study, words).of(trial, settings.do) for words in METHODS.values()]
                for method, limbs in zip(METHODS, tracked, strict=True):
                    found[method] += limbs if all(tracked) else []
    print(machine_line())
    groups = {
        f"{cameras} cameras, {background}": lambda limb, c=cameras, b=background: (
            (limb.trial.cameras, limb.trial.background) == (c, b)
        )
        for cameras in settings.cameras
        for background in settings.backgrounds
    }
    kinds = {kind: lambda limb, k=kind: limb.kind == k for kind in (PLAIN, SKIPPING)}
    for method, limbs in found.items():
        if limbs:
            print(f"\n{method}:\n", regained_table(limbs, groups), "", area_table(limbs, kinds), sep="\n")


if __name__ == "__main__":
    run_script(main)
