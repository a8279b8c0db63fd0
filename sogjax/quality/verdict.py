"""Whether a motion is to be trusted, in absolute terms: what the run itself saw, without a truth."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.io.motion import Motion
from sogjax.model.body import Body
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.limb_warnings import DoubtfulLimb, Limits, doubtful_limbs, joints_at_limits
from sogjax.quality.metrics import stretches

AT_LEAST = 3
"""Frames: shorter stretches are not reported."""
NEARLY_ALL = 0.9
"""Part of every limb whose being hidden by things leaves nothing to judge an actor by."""
IN_ITS_COLORS = 0.85
"""Part of what its example poses explain of an actor, above which it is on its subject; usual are 0.94 to 1.02."""
NUM_WORST = 5
SHOWN = 4
"""Findings of each kind that the sentence names."""


@dataclass(frozen=True)
class Verdict:
    """What is thought of the motion of one actor."""

    actor: str
    wrong: bool
    """Nothing of it can be relied on: another subject, or nobody."""
    findings: tuple[str, ...]
    """What is wrong, or where to look; none: it looks right."""
    explained: float | None
    """Part of the visible area that shows the actor's own colours, the median over the frames; None: not judged."""
    expected: float | None
    """What it was in the example poses."""
    overlap: Mapping[str, float]
    """Of silhouette and foreground in each camera, the median over the frames; empty where no background is known."""
    doubtful: tuple[DoubtfulLimb, ...]
    worst: tuple[int, ...]
    """The frames to look at first."""

    @property
    def looks_right(self) -> bool:
        """Nothing was found."""
        return not self.findings

    @property
    def sentence(self) -> str:
        """In a line; what it rests on, where that is little."""
        if self.findings:
            return "; ".join(self.findings)
        known = self.expected is not None or self.overlap
        return "looks right" if known else "looks right, as far as that is told without a background or example poses"

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self) | {"looks_right": self.looks_right, "sentence": self.sentence}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> "Verdict":
        """What `as_dict` gave, read from JSON.

        Raises:
            KeyError, TypeError: it is something else.
        """
        own: dict[str, Any] = {entry.name: content[entry.name] for entry in fields(cls)}
        own |= {key: tuple(own[key]) for key in ("findings", "worst")}
        own["doubtful"] = tuple(DoubtfulLimb(**limb) for limb in own["doubtful"])
        return cls(**own)


def expected_of(bodies: Sequence[Body]) -> dict[str, float]:
    """How much of each actor its example poses explain, where that is known."""
    return {body.name: float(body.explained) for body in bodies if float(body.explained) > 0.0}


def verdicts(
    motions: Mapping[str, Motion],
    expected: Mapping[str, float],
    limits: Mapping[str, Mapping[str, Limits]] | None = None,
    begun: Mapping[str, str] | None = None,
    odd: Mapping[str, Sequence[str]] | None = None,
    limbs: Mapping[str, Sequence[str]] | None = None,
) -> dict[str, Verdict]:
    """Of the actors of a run.

    `expected` is what actors explain in their example poses, where that is known; `limits` are those of their bodies
    (`limits_of`); `begun` says of actors that their initial pose was not sure, which counts where there is more; `odd`
    says what is odd or doubtful about bodies, and of initial poses that were hardly likely; `limbs` where they jump
    (`jumps`) or are in each other (`passages`).
    """
    limits, begun, odd, limbs = limits or {}, begun or {}, odd or {}, limbs or {}
    return {
        name: _verdict(
            name,
            motion,
            expected=expected.get(name),
            others=_inside(name, motions),
            limbs=limbs.get(name, ()),
            limits=limits.get(name, {}),
            begun=begun.get(name),
            odd=odd.get(name, ()),
        )
        for name, motion in motions.items()
    }


def _verdict(
    name: str,
    motion: Motion,
    expected: float | None,
    others: Sequence[str],
    limbs: Sequence[str],
    limits: Mapping[str, Limits],
    begun: str | None,
    odd: Sequence[str],
) -> Verdict:
    told = _told(motion)
    explained = None if motion.explained is None or not told.any() else float(np.median(motion.explained[told]))
    overlap = _overlaps(motion)
    wrong = [*_wrong(explained, expected, overlap), *others]
    doubtful = doubtful_limbs(motion)
    parts = [*_limbs(doubtful), *_shortened([*limbs]), *_bent(motion, limits)]
    of_itself = None if explained is None or expected is None else explained / expected
    look = [] if wrong else [*_bad_overlaps(overlap, of_itself), *_bad_stretches(motion), *parts]
    look = [*odd, *look]
    if begun is not None and (wrong or look):
        look.append(begun)
    return Verdict(
        actor=name,
        wrong=bool(wrong),
        findings=(*wrong, *look),
        explained=explained,
        expected=expected,
        overlap=overlap,
        doubtful=doubtful,
        worst=worst_frames(motion),
    )


def _told(motion: Motion) -> Bool[np.ndarray, "frame"]:
    """Frames in which enough is seen of the actor to tell who it is: where not nearly all is hidden by things."""
    if motion.limb_hidden is None or not motion.limb_hidden.size:
        return np.ones(motion.num_frames, bool)
    return motion.limb_hidden.min(axis=1) < NEARLY_ALL


def _overlaps(motion: Motion) -> dict[str, float]:
    """Of the cameras that tell it in at least half of the frames."""
    if motion.overlap is None or motion.camera_names is None:
        return {}
    return usual_overlaps(motion.camera_names.tolist(), np.asarray(motion.overlap, float))


def usual_overlaps(names: Sequence[str], overlap: Float[np.ndarray, "frame camera"]) -> dict[str, float]:
    """The median overlap of silhouettes and foreground of cameras that tell it in at least half of the frames."""
    columns = zip(names, overlap.T, strict=True)
    return {name: float(np.nanmedian(column)) for name, column in columns if np.isfinite(column).mean() >= 0.5}


def _wrong(explained: float | None, expected: float | None, overlap: Mapping[str, float]) -> list[str]:
    """What says that nothing can be relied on."""
    bounds, found = fitted_numbers().verdict, []
    if explained is not None and expected is not None and explained < bounds.other_subject * expected:
        found.append(
            f"this is not the subject: {explained:.1%} explained against {expected:.1%} in the example poses "
            "(another person, other clothes, or pictures whose red and blue are exchanged)"
        )
    elif explained is not None and expected is None and explained < bounds.least_explained:
        found.append(f"this is not the subject: only {explained:.1%} of the actor is explained by what is seen")
    if overlap and np.median(list(overlap.values())) < bounds.least_overlap:
        found.append(
            f"the body is not where somebody is seen: silhouettes overlap to {np.median(list(overlap.values())):.0%} "
            "(65 % is usual)"
        )
    return found


def _bad_overlaps(overlap: Mapping[str, float], of_itself: float | None) -> list[str]:
    """Silhouettes that overlap little in all cameras, or in some.

    `of_itself` is how much of an actor is explained, as a part of what its example poses explain; None: not known.
    """
    if not overlap:
        return []
    usual = float(np.median(list(overlap.values())))
    if usual < fitted_numbers().verdict.good_overlap:
        own = of_itself is not None and of_itself > IN_ITS_COLORS
        why = ", though its colours fit: somebody beside it has no actor, or its sizes are wrong" if own else ""
        return [f"look at all of it: silhouettes overlap to {usual:.0%} (65 % is usual){why}"]
    worse = worse_cameras(overlap)
    return _shortened([f"look at {name}: overlaps to {overlap[name]:.0%}, others to {usual:.0%}" for name in worse])


def worse_cameras(overlap: Mapping[str, float]) -> list[str]:
    """Cameras in which silhouettes overlap with the foreground much less than in most; none if they do so nowhere."""
    bounds, usual = fitted_numbers().verdict, float(np.median([*overlap.values()] or [0.0]))
    if usual < bounds.good_overlap:
        return []
    return [name for name, value in overlap.items() if value < bounds.worse_than_most * usual]


def _inside(name: str, motions: Mapping[str, Motion]) -> list[str]:
    """Other actors that are in the same place in most frames."""
    found = []
    for other, motion in motions.items():
        if other != name:
            apart = np.linalg.norm(_middles(motions[name]) - _middles(motion), axis=-1)
            share = float(np.mean(apart < fitted_numbers().verdict.inside))
            if share > 0.5:
                found.append(f"{name} and {other} are inside each other in {share:.0%} of the frames")
    return found


def _middles(motion: Motion) -> Float[np.ndarray, "frame 3"]:
    weights = np.asarray(motion.blob_sigma, float) ** 3
    return np.einsum("fbk,b->fk", motion.blob_means, weights / weights.sum())


def _bad_stretches(motion: Motion) -> list[str]:
    """Frames in which much less of the whole body is explained, or covers foreground, than in most."""
    bad = _share_of_usual(motion).min(axis=1) < fitted_numbers().verdict.worse_than_most
    found = [(int(motion.frame[a]), int(motion.frame[b - 1])) for a, b in stretches(bad, AT_LEAST)]
    return _shortened([f"look at {_frames(*pair)}: the body fits badly" for pair in found])


def _limbs(doubtful: Sequence[DoubtfulLimb]) -> list[str]:
    return _shortened(
        [f"look at {_frames(limb.first_frame, limb.last_frame)}, {limb.name}{_cause(limb)}" for limb in doubtful]
    )


def _cause(limb: DoubtfulLimb) -> str:
    if limb.hidden:
        return " hidden by what stands in front"
    return " (might as well be elsewhere)" if limb.elsewhere else ""


def _bent(motion: Motion, limits: Mapping[str, Limits]) -> list[str]:
    at_limits = joints_at_limits(motion, limits).items()
    return _shortened([f"look at {name}, at its limit in {share:.0%} of the frames" for name, share in at_limits])


def _frames(first: int, last: int) -> str:
    return f"frames {first}-{last}" if last > first else f"frame {first}"


def _shortened(found: list[str]) -> list[str]:
    more = len(found) - SHOWN
    return found if more <= 0 else [*found[:SHOWN], f"and {more} more"]


def _share_of_usual(motion: Motion) -> Float[np.ndarray, "frame measure"]:
    """Each measure of a frame over its median; 1 where there is none."""
    measures = [np.ones(motion.num_frames)]
    if motion.explained is not None:
        measures.append(motion.explained / max(float(np.median(motion.explained)), 1e-6))
    if motion.overlap is not None and np.isfinite(motion.overlap).any():
        known = np.isfinite(motion.overlap).any(axis=1)
        means = np.ones(motion.num_frames)
        means[known] = np.nanmean(motion.overlap[known], axis=1)
        measures.append(means / max(float(np.median(means[known])), 1e-6))
    return np.where(_told(motion)[:, None], np.stack(measures, axis=1), 1.0)


def worst_frames(motion: Motion, count: int = NUM_WORST) -> tuple[int, ...]:
    """The frames that fit worst, by limbs in doubt first; none close to another, in the order of time."""
    doubt = np.zeros(motion.num_frames) if motion.limb_doubt is None else motion.limb_doubt.max(axis=1, initial=0.0)
    badness = doubt + (1.0 - _share_of_usual(motion)).max(axis=1)
    apart = max(motion.num_frames // (4 * count), 1)
    return tuple(int(motion.frame[row]) for row in np.sort(_peaks(badness, count, apart)))


def _peaks(values: Float[np.ndarray, "frame"], count: int, apart: int) -> Int[np.ndarray, "peak"]:
    """The rows of the highest values, so many rows apart at least."""
    chosen: list[int] = []
    for row in np.argsort(-values, kind="stable").tolist():
        if all(abs(row - other) >= apart for other in chosen):
            chosen.append(row)
        if len(chosen) == count:
            break
    return np.array(chosen, int)
