"""How well limbs that are lost are told from others: logistic regression, ROC, shares found against those said."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import expit
from scipy.stats import rankdata

from sogjax.errors import InputError
from sogjax.quality.fitted import Weights, fitted_numbers
from sogjax.quality.limb_confidence import FAR
from sogjax.study.document import Picture, Section
from sogjax.study.limb_trials import PLAIN, JudgedLimb, LimbTrial, LimbTrials
from sogjax.study.study import Study
from sogjax.study.table import ruled_table
from sogjax.view.charts import LimbCurve, limb_chart

BINS = (0.0, 0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)


WeightsOf = Callable[[JudgedLimb], Weights]


def committed(limb: JudgedLimb) -> Weights:
    """The weights that the tracker uses."""
    weights = fitted_numbers().limb_weights
    return weights.without_background if limb.trial.background == "none" else weights.with_background


def said_of(
    limbs: Sequence[JudgedLimb], weights: WeightsOf = committed
) -> tuple[Float[np.ndarray, "value"], Bool[np.ndarray, "value"]]:
    """The probabilities over all frames, and which limbs were lost."""
    return expit(np.concatenate([score(limb, weights(limb)) for limb in limbs])), lost(limbs)


def score(limb: JudgedLimb, weights: Weights) -> Float[np.ndarray, "frame"]:
    """The logarithm of the odds that a limb is lost."""
    return weights.constant + weights.worse * limb.worse + weights.contradicted * limb.contradicted


def lost(limbs: Sequence[JudgedLimb]) -> Bool[np.ndarray, "value"]:
    """Which limbs are farther off than `FAR`, over all frames."""
    return np.concatenate([limb.error for limb in limbs]) > FAR


def area_under_roc(said: Float[np.ndarray, "value"], lost: Bool[np.ndarray, "value"]) -> float:
    """How often a lost limb is doubted more than one in its place; NaN where there is only one kind."""
    count, others = int(lost.sum()), int((~lost).sum())
    if not count or not others:
        return float("nan")
    return float((rankdata(said)[lost].sum() - count * (count + 1) / 2.0) / (count * others))


def limb_curve(limbs: Sequence[JudgedLimb], weights: WeightsOf = committed) -> LimbCurve:
    """What a chart shows of some limbs."""
    said, wrong = said_of(limbs, weights)
    order = np.argsort(-said)
    share = lambda flags: np.concatenate([[0.0], np.cumsum(flags[order]) / max(int(flags.sum()), 1)])
    inside = [(said >= low) & (said <= high) for low, high in pairwise(BINS)]
    mean = lambda values: np.array([values[part].mean() for part in inside if part.any()])
    return LimbCurve(share(~wrong), share(wrong), area_under_roc(said, wrong), mean(said), mean(wrong))


def area_table(
    limbs: Sequence[JudgedLimb], groups: dict[str, Callable[[JudgedLimb], bool]], weights: WeightsOf = committed
) -> str:
    """The area under the ROC by group, and how many limbs have a probability above one half (Markdown)."""
    lines = [["", "limbs x frames", "lost", "area under the ROC", "noticed", "false alarms"]]
    for name, belongs in groups.items():
        group = [limb for limb in limbs if belongs(limb)]
        if group:
            said, wrong = said_of(group, weights)
            noticed, alarms = said[wrong] > 0.5, said[~wrong] > 0.5
            shares = [f"{100.0 * flags.mean():.1f} %" if len(flags) else "" for flags in (noticed, alarms)]
            lines.append([name, str(len(said)), str(int(wrong.sum())), f"{area_under_roc(said, wrong):.3f}", *shares])
    return ruled_table(lines)


def calibration_table(limbs: Sequence[JudgedLimb], weights: WeightsOf = committed) -> str:
    """Shares found lost against the probability that was said (Markdown)."""
    said, wrong = said_of(limbs, weights)
    lines = [["said", "limbs x frames", "mean said", "found lost"]]
    for low, high in pairwise(BINS):
        part = (said >= low) & (said < high if high < 1.0 else said <= high)
        if part.any():
            shares = [f"{100.0 * values[part].mean():.1f} %" for values in (said, wrong)]
            lines.append([f"{100.0 * low:.0f} to {100.0 * high:.0f} %", str(int(part.sum())), *shares])
    return ruled_table(lines)


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
            "by 20 to 30 cm on purpose. A limb is lost if its joints are more than 10 cm off on average; it is "
            "noticed where it is more likely lost than not.",
            area_table(found, groups),
            calibration_table(found),
            *without,
        ],
        [Picture("limbs.png", limb_chart({"all": limb_curve(found)}), "ROC curve, and what was found against said")],
    )
