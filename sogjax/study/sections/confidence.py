"""The section about standard deviations: held against true errors."""

from sogjax.errors import InputError
from sogjax.settings import OutputsConfig
from sogjax.study.document import Picture, Section
from sogjax.study.stated_errors import StatedErrors, kept_stated_errors
from sogjax.study.study import Study
from sogjax.view.charts import calibration_chart


def confidence_section(study: Study) -> Section:
    """Whether the standard deviations of the joints are right.

    Raises:
        InputError: a recording that is not there.
    """
    temperature = OutputsConfig().temperature
    results: dict[str, StatedErrors] = {}
    without = []
    for source in map(study.source, study.recordings):
        try:
            results[source.name] = kept_stated_errors(source, temperature, study.overrides)
        except InputError as error:
            without.append(str(error))
    if not results:
        return Section("Confidence", without)
    lines = ["| recording | found / said | below 1 deviation | below 2 | rank correlation |", "|---|---|---|---|---|"]
    for name, result in results.items():
        ratio = result.mean_square_ratio**0.5
        lines.append(
            f"| {name} | {ratio:.2f} | {result.within(1.0):.0%} | {result.within(2.0):.0%} "
            f"| {result.rank_correlation:.2f} |"
        )
    bins = {name: result.binned() for name, result in results.items()}
    said, found = ({name: pair[k] for name, pair in bins.items()} for k in (0, 1))
    chart = calibration_chart(said, found, "Standard deviations of joints")
    return Section(
        "Confidence",
        [
            "Are the standard deviations of the joints right? (`python experiments/confidence.py`) They follow from "
            f"the curvature of the energy with one temperature, `outputs.temperature={temperature:g}`, calibrated on "
            "walk:0. Compared are joints of all frames, without each joint's mean offset in its own frame, which "
            "belongs to the actor. 68 % and 95 % would be expected of a single coordinate, 61 % and 99 % of a distance "
            "in space whose three coordinates are alike.",
            "\n".join(lines),
            *without,
            "A ratio over 1 says that the deviations are too small there, a rank correlation near 0 that they do not "
            "tell which joints are farther off.",
        ],
        [Picture("confidence.png", chart, "What was said and what was found, in eight bins each")],
    )
