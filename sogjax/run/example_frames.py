"""Example poses from the frames of the videos, where a recording has none."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from sogjax.actor.frame_choice import FRAMES_AT_ONCE, Mask, SeenShape, seen_shape, spread_choice, subject_cubes
from sogjax.actor.make import subjects_of
from sogjax.errors import InputError, counted, listed
from sogjax.io.example_poses import ExamplePose, frame_name
from sogjax.io.recording import Recording
from sogjax.model.cores import in_threads
from sogjax.model.rotation import axis_vector
from sogjax.run.background import Background
from sogjax.run.clip import Clip
from sogjax.run.example_people import (
    AGREEING,
    OTHERWISE,
    has_plates,
    most_seen,
    num_people_seen,
    people_examples,
    told_by_name,
)
from sogjax.run.sampled_masks import SampledMasks, masks_of_samples
from sogjax.run.terminal import say
from sogjax.scene.background import BackgroundImage
from sogjax.scene.visual_hull import MANY, Cube

NUM_TRIED, NUM_EXAMPLES = 8, 5
"""Frames in which the pose is looked for, and those of them that the actor is made of."""
FEWEST_EXAMPLES = 2
OTHER_WAYS = (
    "frames of your choice (`example_poses: [0, 150]` in recording.yaml); pictures of clear poses with masks "
    "(example_poses/POSE/CAMERA.jpg, CAMERA.mask.png); an actor file (actor=FILE)"
)
"""What else can be done where a recording has no example poses, the easiest first."""
LEAST_KNOWN, MOSTLY_KNOWN = 0.2, 0.95
"""Part of the silhouettes where the background must be, and had better be, known."""
LEAST_SHOWN = 0.25
"""Share of the masks that must show a place for it to be the subject's."""
BEHIND = 1
"""Masks more than usual that may lack a part of somebody whom no frame shows otherwise."""
FEW_CAMERAS = 4
"""Fewer of them see too little of a body."""


def with_examples(
    clip: Clip, background: Callable[[], Background], actors: int | None = None
) -> tuple[Recording, tuple[BackgroundImage, ...] | None, int | None]:
    """The recording with example poses, its own or frames of its videos, and the background that their masks need.

    The number is that of the frames to keep, those in which the pose is found best; None: all, since they were given.
    `actors` is how many people the example poses show; None: as many as they name, or one.

    Raises:
        InputError: as `check_actors`; no background is known where masks need one, or no frames show so many people
            whole and apart from it and each other.
    """
    recording = clip.recording
    check_actors(recording, actors)
    if recording.example_poses:
        learnt = background().cameras if need_background(recording) else None
        return _told_apart(clip, learnt), learnt, None
    known = background()
    if known.cameras is None:
        raise InputError(
            f"{recording.path}: there is no actor=FILE, there are no example poses, and none can be taken from the "
            f"videos: {known.reason}. {_ways(recording)}"
        )
    count = 1 if actors is None else actors
    examples = _person_examples(clip, known.cameras) if count == 1 else _people_examples(clip, known.cameras, count)
    return replace(recording, example_poses=examples), known.cameras, NUM_EXAMPLES


def _told_apart(clip: Clip, learnt: tuple[BackgroundImage, ...] | None) -> Recording:
    """The recording, in whose frames that are listed for several actors it is known where each is.

    Raises:
        InputError: that cannot be told.
    """
    recording = clip.recording
    counts = Counter(example.frame for example in recording.example_poses if example.frame is not None)
    shared = [example for example in recording.example_poses if example.frame is not None and counts[example.frame] > 1]
    if not shared or learnt is None:
        return recording
    frames = sorted({example.frame for example in shared if example.frame is not None})
    told = told_by_name(recording, masks_of_samples(clip, learnt, frames), shared)
    if isinstance(told, str):
        raise InputError(f"{recording.path}: example_poses: {told}")
    if all(example.initial_pose is None for example in shared):
        names = " and who is ".join(dict.fromkeys(str(each.actor) for each in told))
        say(
            f"who is {names} is not known: the names are given by chance; if they are exchanged, exchange them in the "
            "list, or give an entry `initial_pose: {position: [X, Y, Z]}`"
        )
    with_places = iter(told)
    examples = tuple(next(with_places) if each in shared else each for each in recording.example_poses)
    return replace(recording, example_poses=examples)


def check_actors(recording: Recording, actors: int | None, num_files: int | None = None) -> None:
    """Check the number of actors that is asked for against the actor files, if any, or else the example poses.

    Raises:
        InputError: it is no number of people, or another one than theirs.
    """
    if actors is None:
        return
    if actors < 1:
        raise InputError(f"actors={actors}: must be a whole number of at least 1, or null")
    if num_files is not None:
        if num_files != actors:
            raise InputError(
                f"actors={actors}: the actors come from actor=, which gives {counted(num_files, 'file')}; leave actors "
                f"out, or give {counted(actors, 'file')}"
            )
        return
    subjects = subjects_of(recording) if recording.example_poses else ()
    if subjects and len(subjects) != actors:
        named = ", ".join(str(name) for name in subjects if name is not None)
        more = "add example poses of the others, each with its `actor`, to recording.yaml"
        fewer = "make those who are wanted (`sogjax actor subject=NAME`) and give their files (actor=)"
        raise InputError(
            f"actors={actors}: the example poses of {recording.path} show {counted(len(subjects), 'actor')}"
            f"{f' ({named})' if named else ''}, and they count; leave actors out, or "
            f"{more if len(subjects) < actors else fewer}"
        )


def need_background(recording: Recording) -> bool:
    """Whether some picture of an example pose has neither a mask nor a picture of the empty scene."""
    without = lambda example: [
        name for name in example.images if name not in example.masks and name not in recording.background
    ]
    return any(example.frame is not None or without(example) for example in recording.example_poses)


def _person_examples(clip: Clip, learnt: Sequence[BackgroundImage]) -> tuple[ExamplePose, ...]:
    recording, seen = clip.recording, masks_of_samples(clip, learnt)
    shapes = seen_shapes(seen, recording.up)
    problem = unsuitable(shapes, lambda: num_people_seen(clip, learnt), has_plates(recording))
    if problem is not None:
        found = next(filter(_suit, _found_otherwise(seen, recording.up, bool(shapes))), None)
        if found is None:
            raise _no_examples(recording, problem)
        shapes = found
    chosen = spread_choice([shape for shape in shapes if shape.agreement > AGREEING], NUM_TRIED)
    _say_chosen([shape.frame for shape in chosen], len(shapes))
    say(f"the actor would gain most from {most_helpful(chosen, len(recording.rig.names), has_plates(recording))}")
    return tuple(ExamplePose(frame_name(shape.frame), None, {}, {}, None, shape.frame) for shape in chosen)


def _suit(shapes: Sequence[SeenShape]) -> bool:
    """Whether example poses of one person can be taken from frames."""
    return unsuitable(shapes, lambda: most_seen([shape.num_bodies for shape in shapes])) is None


def _found_otherwise(seen: SampledMasks, up: str, somebody: bool) -> Iterator[list[SeenShape]]:
    """What the frames show where colours decide what is unknown, and then to those cameras that show anybody at all.

    What hides him from the others stands behind him in some, and may have the colours of his clothes. Where all cameras
    show `somebody`, who is only not apart from others or the room, nothing more is tried.
    """
    if seen.undecided:
        yield seen_shapes(seen.decided(axis_vector(up)), up)
    apart = seen.where_seen()
    if len(apart.cameras) >= MANY and (not somebody or len(apart.cameras) < len(seen.cameras)):
        yield seen_shapes(apart.decided(axis_vector(up)), up, BEHIND)


def _people_examples(clip: Clip, learnt: Sequence[BackgroundImage], actors: int) -> tuple[ExamplePose, ...]:
    examples = people_examples(clip, learnt, actors, NUM_TRIED)
    if isinstance(examples, str):
        raise _no_examples(clip.recording, examples)
    frames = dict.fromkeys(example.frame for example in examples if example.frame is not None)
    _say_chosen(list(frames), None)
    return examples


def _no_examples(recording: Recording, problem: str) -> InputError:
    return InputError(
        f"{recording.path}: no example poses can be taken from the videos, since {problem}. {_ways(recording)}"
    )


def _ways(recording: Recording) -> str:
    """What is done by itself where a recording has no example poses, and what else can be done."""
    if has_plates(recording):
        return f"Without example poses, frames of the videos are taken as such. Other ways: {OTHER_WAYS}"
    without = listed([name for name in recording.rig.names if name not in recording.background])
    whose = f" of {without}" if recording.background else ""
    return (
        f"Without example poses, the background{whose} is learnt from the videos, and frames of them are taken as "
        f"example poses. Other ways, the easiest first: pictures of the empty scene{whose} (background/CAMERA.jpg); "
        f"{OTHER_WAYS}"
    )


def _say_chosen(frames: Sequence[int], num_seen: int | None) -> None:
    shown = ", ".join(str(frame) for frame in frames)
    looked_at = "" if num_seen is None else f" ({counted(num_seen, 'frame')} looked at)"
    say(f"example poses: frames {shown} of the videos{looked_at}")


def unsuitable(shapes: Sequence[SeenShape], num_people: Callable[[], int], plates: bool = False) -> str | None:
    """Why no example poses of one person can be taken from frames, and the remedy; None: they can.

    `plates` says whether every camera has a picture of the empty scene. `num_people` counts better than the parts of
    the hulls do, but takes seconds: a body may be seen in parts.
    """
    if show_several(shapes) and (people := num_people()) != 1:
        return several_people(people)
    if shapes and np.median([shape.known for shape in shapes]) < LEAST_KNOWN:
        return (
            "the subject stands in the same place throughout, and what is behind is never seen; give pictures of the "
            "empty scene as background/CAMERA.jpg"
        )
    if sum(shape.agreement > AGREEING for shape in shapes) < FEWEST_EXAMPLES:
        return (
            "nobody is seen in them whole and apart from the background; if somebody is, `sogjax check` may say "
            "which videos are under the names of other cameras; else give "
            f"{'' if plates else 'pictures of the empty scene as background/CAMERA.jpg, or '}"
            "example_poses/POSE/CAMERA.jpg with CAMERA.mask.png"
        )
    return None


def show_several(shapes: Sequence[SeenShape]) -> bool:
    """Whether most frames show more than one body."""
    return bool(shapes) and float(np.median([shape.num_bodies for shape in shapes])) > 1.0


def several_people(seen: int) -> str:
    """What is said where one person is asked for and so many are seen; 0: nobody knows how many."""
    shown = f"{seen} people" if seen > 1 else "more than one person"
    return f"they show {shown}; make an actor of each with actors={max(seen, 2)}, {OTHERWISE}"


def most_helpful(chosen: Sequence[SeenShape], num_cameras: int, plates: bool = False) -> str:
    """What would improve an actor that is made of frames most; `plates`: the empty scene is pictured already."""
    if not plates and np.mean([shape.known for shape in chosen]) < MOSTLY_KNOWN:
        return "pictures of the empty scene (background/CAMERA.jpg): a part of it is never seen in the videos"
    if num_cameras < FEW_CAMERAS:
        return f"more cameras: there are {num_cameras}"
    return "pictures of a T-pose, of bent elbows and of a squat (example_poses/POSE/CAMERA.jpg)"


def seen_shapes(seen: SampledMasks, up: str, misses: int = 0) -> list[SeenShape]:
    """What frames spread over the videos show, where somebody is seen; `misses` as in `seen_shape`."""

    def of_frame(row: tuple[int, dict[int, Mask], Cube | None]) -> SeenShape | None:
        frame, masks, cube = row
        if cube is None:
            return None
        return seen_shape(frame, masks, seen.unknown, seen.cameras, cube, axis_vector(up), LEAST_SHOWN, misses)

    rows = zip(seen.frames, seen.masks, subject_cubes(seen.masks, seen.cameras), strict=True)
    return [shape for shape in in_threads(of_frame, rows, FRAMES_AT_ONCE) if shape is not None]
