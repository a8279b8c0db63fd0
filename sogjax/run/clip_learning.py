"""Learning the backgrounds of a recording's cameras from its clip: reading samples, and refusing unsuitable clips."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from sogjax.io.recording import Recording
from sogjax.model.cores import in_threads
from sogjax.model.rotation import axis_vector
from sogjax.run.clip import Clip, SampleKind, spread_frames
from sogjax.run.terminal import say
from sogjax.scene.background import BackgroundImage
from sogjax.scene.background_difference import working_size
from sogjax.scene.clip_background import FEWEST_SAMPLES, MOST_SAMPLES, SampledCamera, learnt_background, moves, shaking
from sogjax.scene.coarse_views import CoarseViews
from sogjax.scene.floor import seen_floors, with_floor
from sogjax.scene.moving_zone import moving_zones
from sogjax.scene.still_body import Standing, still_bodies, with_room_behind
from sogjax.scene.still_zone import StillZones, standing_zones, still_zones
from sogjax.scene.visual_hull import MANY

MOST_BYTES = 2**30
"""Bytes of samples in memory; beyond, fewer frames are looked at."""
MUCH_UNKNOWN = 0.15
"""Share of the pictures from which on an unknown background is said."""
FURNITURE = 0.75
"""What never moves, may be somebody and is no body, in units of what moves: 1.1 to 1.3 beside a table and a chair, 0 to
0.6 without. Fewer than five cameras do not tell a body."""
Zone = Bool[np.ndarray, "rows columns"]
LeftOut = Mapping[str, Mapping[int, Bool[np.ndarray, "rows columns"]]]
"""Where, by camera and frame, the tracked bodies are."""


class UnsuitableError(Exception):
    """Why nothing can be learnt from a clip, and the remedy."""


def background_samples(recording: Recording) -> SampleKind:
    """The pictures that a background is learnt from, at the size at which it is learnt."""
    sizes = [working_size(*recording.rig.image_size(name)) for name in recording.rig.names]
    room = MOST_BYTES // (3 * sum(width * height for width, height in sizes))
    frames = spread_frames(recording.frames, int(np.clip(room, MOST_SAMPLES // 2, MOST_SAMPLES)))
    return SampleKind.at_working_size("background", recording, frames)


def learnt_from(
    clip: Clip, left_out: LeftOut | None = None, more: Sequence[SampleKind] = ()
) -> tuple[BackgroundImage, ...]:
    """The background of every camera, from a clip in which somebody moves about.

    Args:
        clip: to learn from, as a whole.
        left_out: where samples do not count.
        more: samples of other kinds to take on the way.

    Raises:
        UnsuitableError: nothing can be learnt.
        InputError: a video cannot be read.
    """
    recording = clip.recording
    names, kind = recording.rig.names, background_samples(recording)
    if len(kind.frames) < FEWEST_SAMPLES:
        raise _too_few(f"{len(kind.frames)} frames")
    samples = clip.sampled([kind, *more])[0]
    few = next((k for k, of_camera in enumerate(samples) if len(of_camera) < FEWEST_SAMPLES), None)
    if few is not None:
        raise _too_few(f"{len(samples[few]) or len(kind.frames)} frames of {names[few]}")
    cameras = {k: recording.rig.camera(name) for k, name in enumerate(names)}
    sampled = dict(enumerate(in_threads(SampledCamera.from_images, samples)))
    sampled = _steady(recording, sampled, in_threads(shaking, sampled.values()))
    each = lambda make: dict(zip(sampled, in_threads(make, sampled), strict=True))
    spans = range(min(len(one.movements) for one in sampled.values()))
    movements = [{k: one.movements[span] for k, one in sampled.items()} for span in spans]
    zones = moving_zones(movements, cameras, axis_vector(recording.up))
    if left_out is None:
        learnt = _told_together(recording, sampled, zones, each)
    else:
        learnt = each(lambda k: learnt_background(sampled[k], zones[k], None, left_out.get(names[k])))
        _say_unknown(recording, learnt)
    nothing = lambda name: BackgroundImage.nothing(*working_size(*recording.rig.image_size(name)))
    return tuple(learnt.get(k) or nothing(name) for k, name in enumerate(names))


def _steady(
    recording: Recording, sampled: Mapping[int, SampledCamera], shifts: Sequence[float]
) -> dict[int, SampledCamera]:
    """The cameras that do not move, if anything moves in their pictures.

    Raises:
        UnsuitableError: nothing moves, or hardly a camera stands still.
    """
    if not moves(sampled):
        raise UnsuitableError(
            "nobody moves in the clip, and who stands still cannot be told from the room; give pictures of the "
            "empty scene as background/CAMERA.jpg, or a clip in which the subject moves about"
        )
    shaken = _shaken(recording, shifts)
    return {k: one for k, one in sampled.items() if recording.rig.names[k] not in shaken}


def _told_together(
    recording: Recording,
    sampled: Mapping[int, SampledCamera],
    zones: Mapping[int, Zone],
    each: Callable[[Callable[[int], BackgroundImage]], dict[int, BackgroundImage]],
) -> dict[int, BackgroundImage]:
    """The background of each camera, in which all of them together tell who stands still.

    `each` makes it of every camera, several at a time.
    """
    moving = {k: np.any(one.movements, axis=0) for k, one in sampled.items()}
    shown = {k: one.even.reference for k, one in sampled.items()}
    cameras = {k: recording.rig.camera(recording.rig.names[k]) for k in sampled}
    views = CoarseViews.of(moving, shown, cameras, axis_vector(recording.up))
    still, floors, bodies, furniture = dict(zones), {}, {}, False
    if views is not None:
        floors = seen_floors(views)
        bodies = {} if recording.masked else still_bodies(views, floors)
        large = np.mean([zone.mean() for zone in zones.values()]) > MUCH_UNKNOWN
        found = still_zones(zones, views) if large else StillZones(still, still)
        over_floor = lambda masks: standing_zones(masks, views, floors) if floors else masks
        still, many = over_floor(found.narrow), len(views.moving) >= MANY
        furniture = many and bool(bodies) and _beside_furniture(still, moving, bodies)
        still = over_floor(found.wide) if large and many and not furniture else still
    learnt = each(lambda k: learnt_background(sampled[k], zones[k], still[k], mostly=furniture))
    if floors:
        learnt = each(lambda k: with_floor(learnt[k], floors.get(k), sampled[k].even.images, zones[k]))
    _say_unknown(recording, learnt)
    if furniture:
        return {k: replace(background, furnished=True) for k, background in learnt.items()}
    if not bodies:
        return learnt
    return each(lambda k: with_room_behind(learnt[k], bodies[k], moving[k], shown[k], floors.get(k)))


def _beside_furniture(still: Mapping[int, Zone], moving: Mapping[int, Zone], bodies: Mapping[int, Standing]) -> bool:
    """Whether much may be somebody who never moves, and is no body. There a colour tells less."""
    other = {k: still[k] & ~moving[k] & ~bodies[k].perhaps for k in bodies}
    shares = [other[k].sum() / max((moving[k] | bodies[k].surely).sum(), 1) for k in bodies]
    return float(np.median(shares)) > FURNITURE


def _too_few(frames: str) -> UnsuitableError:
    return UnsuitableError(
        f"{frames} are too few to tell the subject from the room (at least {FEWEST_SAMPLES} are needed); give a "
        "longer clip, or pictures of the empty scene as background/CAMERA.jpg"
    )


def _shaken(recording: Recording, shifts: Sequence[float]) -> set[str]:
    """Cameras that move, of which nothing can be learnt; that is said, or refused where hardly any other is left."""
    moved = {name: shift for name, shift in zip(recording.rig.names, shifts, strict=True) if shift}
    if not moved:
        return set()
    scale = lambda name: max(recording.rig.image_size(name)) / max(working_size(*recording.rig.image_size(name)))
    shown = ", ".join(f"{name} by up to {scale(name) * shift:.1f} px" for name, shift in moved.items())
    said = (
        f"cameras move during the clip ({shown}), and neither a background nor the calibration holds for them; film "
        "with cameras that stand firmly, or leave these out with cameras=[...]"
    )
    if len(recording.rig.names) - len(moved) < 2:
        raise UnsuitableError(said)
    say(f"warning: {recording.path}: {said}")
    return set(moved)


def _say_unknown(recording: Recording, learnt: Mapping[int, BackgroundImage]) -> None:
    share = 1.0 - float(np.mean([background.known.mean() for background in learnt.values()]))
    if share > MUCH_UNKNOWN:
        say(
            f"warning: {recording.path}: the background of {share:.0%} of the pictures stays unknown, since the "
            "subject hardly leaves its place; pictures of the empty scene as background/CAMERA.jpg help"
        )
