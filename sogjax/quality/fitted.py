"""The numbers that rest on recordings, as typed records; `fitted.yaml` holds them and says what each rests on."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, get_args, get_type_hints

import yaml

PATH = Path(__file__).with_name("fitted.yaml")
VERSION = 1
"""The version of the file's layout that this module reads."""


@dataclass(frozen=True)
class Weights:
    """The weights of a logistic regression on the measures of a limb (`LimbMeasures`)."""

    constant: float
    worse: float
    """Weight of each unit of log likelihood by which the colours fit worse than usual."""
    contradicted: float
    """Weight of the share of places in which the background is seen more often than usual."""


@dataclass(frozen=True)
class LimbWeights:
    """How likely a limb is lost: one regression for cameras with a known background, one for those without."""

    with_background: Weights
    without_background: Weights


@dataclass(frozen=True)
class Rivals:
    """How much other ways to hold a limb count that are worth about as much."""

    weight: float
    """Of each per cent of an actor's energy, on the log odds that the limb is lost."""
    doubtful: float
    """From how likely lost on a limb is in doubt whose rivals are known."""


@dataclass(frozen=True)
class LimbBaseline:
    """What a blob usually shows, against which a limb is measured."""

    least_own: float
    """A blob whose colours fit less from the beginning is measured against this: it may never have been right."""
    most_contradicted: float
    """A blob that is more often background than this from the beginning is measured against it."""
    adaptation: float
    """The part of the difference from what is seen by which the baseline follows it in each frame."""
    largest_steps: tuple[float, ...]
    """The largest differences that count, for `own` and `contradicted`."""
    unseen: float
    """The part of a blob's area in the pictures below which what is seen of it says little."""


@dataclass(frozen=True)
class VerdictBounds:
    """What makes the motion of an actor wrong, or worth a look."""

    other_subject: float
    """Who explains less than this part of what the actor explains in its example poses is not the actor."""
    least_explained: float
    """The part of the visible area that an actor without known example poses must explain."""
    least_overlap: float
    """The median overlap of silhouettes and foreground below which nobody is there; who is followed has 0.6 to 0.75."""
    good_overlap: float
    """The median overlap below which a motion must be looked at."""
    worse_than_most: float
    """Frames, and cameras, below this part of the median must be looked at."""
    inside: float
    """Metres between the middles of two actors, below which they are inside each other."""
    limb_doubtful: float
    """How likely lost a limb must be in a frame to be in doubt there."""


@dataclass(frozen=True)
class Bound:
    """The least value of a measure: where the background is known, and where it is not."""

    with_background: float
    without_background: float
    scale: float
    """By how much a pose must miss the bound to be no more likely right than wrong."""


@dataclass(frozen=True)
class PoseEvidenceBounds:
    """What a pose must reach to be sure by one search; the fields are those of `PoseEvidence`."""

    energy: Bound
    margin: Bound
    later_margin: Bound
    foreground: Bound
    worst_foreground: Bound
    gain: Bound
    not_background: Bound
    share: Bound


@dataclass(frozen=True)
class PoseAgreementBounds:
    """What makes two searches in frames some time apart sure; a `scale` is as in `Bound`."""

    most_apart: float
    """Metres within which two searches agree."""
    most_apart_among_others: float
    """Metres, where several actors are searched for: one taken for the other is seen in both frames, too."""
    apart_scale: float
    least_moved: float
    """Metres: who moves less gives two searches the same reasons to be wrong."""
    moved_scale: float
    least_sides: float
    """Limbs of a pair that are nearer to each other than this part of the least in any named pose are exchanged."""
    sides_scale: float
    least_limb: float
    """A limb that explains less than this is elsewhere."""
    limb_scale: float
    least_share: float
    """An actor of whom less is left beside the others may be anywhere in the rest."""
    share_scale: float


@dataclass(frozen=True)
class MergeCosts:
    """When two passes over a clip are compared, and what taking a part of the body from the other one costs."""

    doubtful: float
    """A limb whose error is more probable than this makes its frame one that is tracked backwards."""
    compared: float
    """Metres, mean over the blobs of a part: farther apart, it is asked which pass is better."""
    together: float
    """Metres within which the passes agree; those of fast motions lag behind from both sides."""
    apart: float
    """Metres from which on a part is taken from the other pass."""
    change: float
    """The part of a frame's energy that a change from one pass to the other costs for each metre between them."""
    leap: float
    """The same for each metre by which a part leaps from one frame to the next, in a pass or between two."""
    bias: float
    """The part of a frame's energy that a part of the body must gain in a frame at least; of passes that are taken
    whole, nothing is asked but what changes cost."""


@dataclass(frozen=True)
class Proportions:
    """What makes the bones of an actor odd."""

    most_odd: float
    """Logarithm of how many times as long as in the starting body a bone may be, for the size of the whole."""
    least_size: float
    """How many times as long as those of the adult that comes with the package the bones of a human are, at least."""
    most_size: float
    """The same, at most."""


@dataclass(frozen=True)
class Fitted:
    """All numbers of the file, by its parts."""

    limb_weights: LimbWeights
    rivals: Rivals
    limb_baseline: LimbBaseline
    verdict: VerdictBounds
    pose_evidence: PoseEvidenceBounds
    pose_agreement: PoseAgreementBounds
    merge_passes: MergeCosts
    proportions: Proportions


@cache
def fitted_numbers() -> Fitted:
    """The numbers of this installation."""
    return read_fitted(PATH.read_text(encoding="utf-8"))


def read_fitted(text: str) -> Fitted:
    """The numbers in the text of such a file.

    Raises:
        ValueError: the text has another version, or lacks a part or a value, or has one that is unknown.
    """
    content = yaml.safe_load(text)
    if content.pop("version", None) != VERSION:
        raise ValueError(f"{PATH.name}: the version must be {VERSION}")
    return _record(Fitted, {name: part["values"] for name, part in content.items()})


def _record(kind: Any, value: Any) -> Any:
    """A record of a kind from a mapping, or a tuple or number from itself."""
    if not isinstance(kind, type) or not is_dataclass(kind):
        return tuple(map(get_args(kind)[0], value)) if get_args(kind) else kind(value)
    names = [entry.name for entry in fields(kind)]
    if not isinstance(value, Mapping) or set(value) != set(names):
        raise ValueError(f"{PATH.name}: {kind.__name__} needs {', '.join(names)}; got {value}")
    hints = get_type_hints(kind)
    return kind(**{name: _record(hints[name], value[name]) for name in names})
