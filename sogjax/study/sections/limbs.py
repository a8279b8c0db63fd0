"""The section about limbs in doubt: what was said of them, held against the truth."""

from sogjax.errors import InputError
from sogjax.study.document import Picture, Section
from sogjax.study.limb_calibration import area_table, calibration_table, limb_curve
from sogjax.study.limb_trials import PLAIN, JudgedLimb, LimbTrial, LimbTrials
from sogjax.study.study import Study
from sogjax.view.charts import limb_chart


def limbs_section(study: Study) -> Section:
    """Whether limbs that are in doubt are lost, and others in their places.

    Raises:
        InputError: a recording that is not there.
    """
    trials = LimbTrials(study, study.overrides)
    found: list[JudgedLimb] = []
    without = []
    for name in study.recordings:
        try:
            found += trials.of(LimbTrial(name, name, None, "auto"), study.do)
        except InputError as error:
            without.append(str(error))
    if not found:
        return Section("Limbs in doubt", without or ["No recording was tracked for this."])
    names = dict.fromkeys(limb.trial.sequence for limb in found)
    groups = {
        "all": lambda limb: True,
        "as recorded": lambda limb: limb.kind == PLAIN,
        **{name: lambda limb, n=name: limb.trial.sequence == n for name in names},
    }
    return Section(
        "Limbs in doubt",
        [
            "Is a limb that is in doubt lost, and one that is not in its place? (`python experiments/limb_doubt.py`) "
            "The recordings are tracked as they are, with two of three frames left out, and with each limb displaced "
            "by 20 to 30 cm on purpose. A limb is lost if its joints are more than 10 cm off on average; it is in "
            "doubt where it is more likely lost than not.",
            area_table(found, groups),
            calibration_table(found),
            *without,
        ],
        [Picture("limbs.png", limb_chart({"all": limb_curve(found)}), "ROC curve, and what was found against said")],
    )
