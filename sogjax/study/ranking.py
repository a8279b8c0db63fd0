"""A track held against its truth, ranked by a set of terms; the rankings as tables and files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from sogjax.errors import InputError
from sogjax.io.cache_folder import default_cache_dir
from sogjax.io.files import csv_text, write_file
from sogjax.io.ground_truth import GroundTruth, load_ground_truth
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.run.recordings import upright
from sogjax.settings.compose import track_config
from sogjax.study.climbs import ranked
from sogjax.study.table import ruled_table
from sogjax.study.true_poses import true_poses
from sogjax.study.verdicts import EQUAL, UNKNOWN, VERDICTS, Ranking, limb_errors
from sogjax.view.charts import RankedCurves

DEFAULT = "default"
"""The set without any word."""


@dataclass(frozen=True)
class RankedTrack:
    """Tracked poses and true ones of the same frames."""

    recording: Recording
    truth: GroundTruth
    actors: list[Body]
    """The actors in their own upright frames."""
    frames: Int[np.ndarray, "frame"]
    """The recording's numbers, one after the other."""
    tracked: Float[np.ndarray, "frame dof"]
    """The tracked poses of all actors beside each other."""
    true: Float[np.ndarray, "frame dof"]
    """NaN where the truth is not known."""

    @classmethod
    def of(cls, recording: Recording, motions: Sequence[Motion], actors: Sequence[Body]) -> "RankedTrack":
        """Motions of actors, in their order.

        Raises:
            InputError: no truth, or motions that are not those of the actors or of different frames.
        """
        if recording.ground_truth is None:
            raise InputError(f"{recording.path}: has no ground_truth.npz; give a recording with ground truth")
        truth = load_ground_truth(recording.ground_truth)
        frames = np.asarray(motions[0].frame, int)
        for actor, motion in zip(actors, motions, strict=True):
            if tuple(motion.dof_names.tolist()) != actor.skeleton.dof_names:
                raise InputError(f"actor {actor.name!r}: has other degrees of freedom than its motion; give its actor")
            if not np.array_equal(motion.frame, frames) or frames[-1] >= truth.num_frames:
                raise InputError("motion: the motions and the truth have different frames; give those of one track")
        bodies = [upright(actor, recording) for actor in actors]
        alone = len(bodies) == 1 and not truth.subjects
        of_body = [truth if alone else truth.subject(body.name) for body in bodies]
        true = [true_poses(body, part, recording.up)[frames] for body, part in zip(bodies, of_body, strict=True)]
        tracked = [np.asarray(motion.pose, float) for motion in motions]
        return cls(recording, truth, [*actors], frames, np.concatenate(tracked, axis=1), np.concatenate(true, axis=1))


def ranking_of(track: RankedTrack, words: str, far: float, every: int = 1) -> Ranking:
    """The ranking of a track by the terms, pictures and solver of a set.

    Args:
        track: that is ranked.
        words: options of track, with spaces between them.
        far: metres; a limb that is farther off is lost.
        every: of how many frames one is looked at.
    """
    given = [] if words == DEFAULT else words.split()
    cache: Mapping[str, str] = {"cache": str(default_cache_dir() / "cells")}
    config = track_config(given, recording=track.recording.path, images=cache, outputs={"confidence": False})
    starts = [track.tracked, track.true]
    pair = ranked(track.recording, track.actors, config, track.frames - track.recording.first_frame, starts, every)
    bodies = [upright(actor, track.recording) for actor in track.actors]
    frames = track.frames[::every]
    poses = (track.tracked[::every], pair.tracked.poses, pair.true.poses, track.true[::every])
    errors = [limb_errors(bodies, track.truth, frames, each) for each in poses]
    return Ranking(words, frames, pair, *errors, far=far)


MM = 1000.0


def verdicts_table(rankings: Sequence[Ranking]) -> str:
    """A line for each set: how many frames have which verdict, the smallest gain, and the mean joint errors."""
    titles = ["set", *VERDICTS, "wrong worth more", "least gain", "tracked, mm", "reached", "optimum", "fit"]
    lines = [titles]
    for ranking in rankings:
        counts = [str(ranking.verdicts.count(verdict)) for verdict in VERDICTS]
        known = ranking.gain[np.isfinite(ranking.gain)]
        least = f"{100.0 * known.min():+.2f} %" if known.size else "no truth"
        wrong = f"{np.sum(known < -EQUAL)} of {known.size}"
        errors = (ranking.tracked, ranking.reached, ranking.optimum, ranking.fitted)
        lines.append([ranking.name, *counts, wrong, least, *(_millimetres(each.mean) for each in errors)])
    meanings = "\n".join(f"{verdict}: {meaning}" for verdict, meaning in VERDICTS.items())
    return f"{ruled_table(lines)}\n\n{meanings}"


def oracle_table(rankings: Sequence[Ranking]) -> str:
    """A line for each set: the truth as one more hypothesis beside the tracked pose, climbed from and judged as it is.

    How often the higher energy chooses the truth, by what share of the energy it is worth more, in all frames and in
    those with a lost limb, and the mean joint errors before and after the choice.
    """
    lines = [
        ["set", "frames", "truth chosen", "mean gain", "lost", "truth chosen", "mean gain", "reached, mm", "chosen"]
    ]
    for ranking in rankings:
        known = np.isfinite(ranking.gain)
        lost = known & ranking.lost.any(axis=1)
        errors = [_millimetres(each[known]) for each in (ranking.reached.mean, ranking.chosen)]
        lines.append([ranking.name, *_choice(ranking.gain[known]), *_choice(ranking.gain[lost]), *errors])
    return f"The truth as one more hypothesis, chosen where it is worth more after the climb:\n\n{ruled_table(lines)}"


def _choice(gains: Float[np.ndarray, "frame"]) -> list[str]:
    """How many frames, in what share of them the truth is worth more, and by how much on average."""
    if not gains.size:
        return ["0", "", ""]
    return [str(gains.size), f"{100.0 * np.mean(gains > EQUAL):.0f} %", f"{100.0 * gains.mean():+.3f} %"]


def limbs_table(rankings: Sequence[Ranking]) -> str:
    """A line for each set and lost limb: where it was lost, and the verdicts of those frames."""
    lines = [["set", "limb", "frames", "lost in", *list(VERDICTS)[1:], "tracked, mm", "reached", "optimum"]]
    for ranking in rankings:
        for limb in np.flatnonzero(ranking.lost.any(axis=0)):
            of_limb = ranking.of_limb(int(limb))
            rows = np.flatnonzero(of_limb.lost[:, 0])
            counts = [str(of_limb.verdicts.count(verdict)) for verdict in list(VERDICTS)[1:]]
            span = f"{ranking.frames[rows[0]]} to {ranking.frames[rows[-1]]}"
            errors = [each.limbs[rows, 0] for each in (of_limb.tracked, of_limb.reached, of_limb.optimum)]
            name = of_limb.tracked.names[0]
            lines.append([ranking.name, name, span, str(len(rows)), *counts, *(_millimetres(each) for each in errors)])
    return ruled_table(lines) if len(lines) > 1 else "No limb is lost."


def terms_table(rankings: Sequence[Ranking]) -> str:
    """A line for each set: by what share of the energy the truth is worth more in frames with a loss, term by term."""
    names = list(dict.fromkeys(name for ranking in rankings for name in ranking.pair.true.parts))
    lines = [["gain of the true pose where a limb is lost, %", "energy", *names]]
    for ranking in rankings:
        rows = ranking.lost.any(axis=1) & np.isfinite(ranking.gain)
        if rows.any():
            by_term = curves_of(ranking).gain_by_term
            gains = [f"{100.0 * by_term[name][rows].mean():+.3f}" if name in by_term else "" for name in names]
            lines.append([ranking.name, f"{100.0 * ranking.gain[rows].mean():+.3f}", *gains])
    return ruled_table(lines) if len(lines) > 1 else "No frame has a loss."


def curves_of(ranking: Ranking) -> RankedCurves:
    """A ranking's column of the chart; limbs that are lost by the tracked poses or the optima at the truth."""
    true, tracked = ranking.pair.true, ranking.pair.tracked
    gains = {name: (true.parts[name] - tracked.parts[name]) / np.abs(true.energy) for name in true.parts}
    differ = np.flatnonzero((ranking.lost | (ranking.optimum.limbs > ranking.far)).any(axis=0))
    return RankedCurves(
        title=ranking.name,
        frames=ranking.frames,
        gain=ranking.gain,
        gain_by_term=gains,
        errors={
            "tracked": ranking.tracked.mean,
            "optimum above the tracked pose": ranking.reached.mean,
            "optimum above the true pose": ranking.optimum.mean,
            "true pose of this skeleton": ranking.fitted.mean,
        },
        limbs={ranking.tracked.names[k]: (ranking.tracked.limbs[:, k], ranking.optimum.limbs[:, k]) for k in differ},
    )


def write_csv(path: Path, rankings: Sequence[Ranking]) -> None:
    """A row for each set and frame: verdict, energies, what each term adds to either, errors in millimetres."""
    terms = list(dict.fromkeys(name for ranking in rankings for name in ranking.pair.true.parts))
    limbs = rankings[0].tracked.names if rankings else ()
    sides = ("tracked", "reached", "optimum", "fitted")
    head = ["set", "frame", "verdict", "gain", "energy tracked", "energy true"]
    head += [f"{term} {side}" for term in terms for side in ("tracked", "true")]
    head += [f"{side} mm" for side in sides] + [f"{limb} {side} mm" for limb in limbs for side in sides[:3]]
    lines = [
        [ranking.name, frame, ranking.verdicts[k], *_numbers(ranking, k, terms)]
        for ranking in rankings
        for k, frame in enumerate(ranking.frames)
    ]
    write_file(path, csv_text([head, *lines]))


def _numbers(ranking: Ranking, frame: int, terms: Sequence[str]) -> list[str]:
    true, tracked = ranking.pair.true, ranking.pair.tracked
    if ranking.verdicts[frame] == UNKNOWN:
        return []
    values = [ranking.gain[frame], tracked.energy[frame], true.energy[frame]]
    for term in terms:
        values += [side.parts[term][frame] if term in side.parts else np.nan for side in (tracked, true)]
    errors = (ranking.tracked, ranking.reached, ranking.optimum, ranking.fitted)
    lengths = [MM * each.mean[frame] for each in errors]
    lengths += [MM * each.limbs[frame, k] for k in range(len(ranking.tracked.names)) for each in errors[:3]]
    return [f"{value:.7g}" for value in values] + [f"{value:.1f}" for value in lengths]


def _millimetres(values: np.ndarray) -> str:
    present = values[np.isfinite(values)]
    return f"{MM * present.mean():.1f}" if present.size else ""
