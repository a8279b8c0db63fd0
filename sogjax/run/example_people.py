"""Example poses of several people from the frames of the videos in which they stand apart."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sogjax.actor.frame_choice import (
    FRAMES_AT_ONCE,
    LEAST_BESIDE,
    Mask,
    SeenShape,
    seen_shape,
    spread_choice,
    spread_moments,
    subject_cubes,
)
from sogjax.actor.people import PersonSeen, matched, people_apart, told_apart
from sogjax.errors import counted
from sogjax.io.example_poses import ExamplePose, frame_name
from sogjax.io.recording import Recording
from sogjax.model.cores import in_threads
from sogjax.model.rotation import axis_vector
from sogjax.run.clip import Clip
from sogjax.run.sampled_masks import Picture, SampledMasks, masks_of_samples
from sogjax.scene.background import BackgroundImage
from sogjax.scene.background_difference import reduced_mask
from sogjax.scene.cells import CellGrid
from sogjax.scene.visual_hull import Cube

AGREEING = 0.45
"""Least agreement of everybody's hull and silhouettes in a frame."""
FEWEST_APART = 2
"""Frames in which all stand apart; fewer make no actors."""
MOST = 0.7
"""Part of the frames that must show another number of people for it to be recommended: two who pass are seen as one."""
OTHERWISE = (
    "list frames in which each stands alone as example_poses in recording.yaml, such as [{frame: 12, actor: anna}, "
    "{frame: 300, actor: ben}], or give actor files with actor=[...]"
)

Moment = tuple[SeenShape, ...]


def person_name(number: int) -> str:
    """How the actor of one of several people is called, counted from 0."""
    return f"person_{number + 1}"


def num_people_seen(clip: Clip, learnt: Sequence[BackgroundImage]) -> int:
    """How many people most frames show that show any; 0: none does."""
    seen = masks_of_samples(clip, learnt)
    return most_seen([len(people) for people in everybody(seen, clip.recording.up)])


def most_seen(counts: Sequence[int]) -> int:
    """The number of people that is seen most often, of several that are equally often the largest; 0: none is seen."""
    found = Counter(count for count in counts if count)
    return max(found, key=lambda count: (found[count], count), default=0)


def people_examples(
    clip: Clip, learnt: Sequence[BackgroundImage], actors: int, count: int
) -> tuple[ExamplePose, ...] | str:
    """At most `count` frames as example poses of each of several people, or why there are none, with the remedy."""
    seen = masks_of_samples(clip, learnt)
    examples = examples_of_masks(clip.recording, seen, actors, count)
    if not isinstance(examples, str) or not seen.undecided:
        return examples
    second = examples_of_masks(clip.recording, seen.decided(axis_vector(clip.recording.up)), actors, count)
    return examples if isinstance(second, str) else second


def examples_of_masks(
    recording: Recording, seen: SampledMasks, actors: int, count: int
) -> tuple[ExamplePose, ...] | str:
    """What `people_examples` gives, from what is not the background in some frames."""
    moments = everybody(seen, recording.up)
    if sum(len(people) == actors for people in moments) < FEWEST_APART:
        moments = everybody(seen, recording.up, actors)
    apart, counts = [people for people in moments if len(people) == actors], [len(people) for people in moments]
    another = most_seen(counts) != actors  # the number that is asked for may be that of a few specks
    if len(apart) < FEWEST_APART:
        return too_few_apart(actors, counts, has_plates(recording))
    told = told_apart(apart, recording.fps)
    if len(told) < max(FEWEST_APART, len(apart) // 2):
        alike = (
            f"the {actors} people stand apart in {counted(len(apart), 'frame')}, but their colours are too much alike "
            f"to tell who is who; {OTHERWISE}"
        )
        return too_few_apart(actors, counts, has_plates(recording)) if another else alike
    shapes = [_shapes([moment[k] for moment in told], seen, recording.up) for k in range(actors)]
    chosen = chosen_frames(shapes, count)
    if min(map(len, chosen)) < FEWEST_APART:
        hidden = (
            f"the {actors} people are never seen whole and apart from the background; "
            f"{_plates_or(has_plates(recording))}{OTHERWISE}"
        )
        return too_few_apart(actors, counts, has_plates(recording)) if another else hidden
    by_frame = {moment[0].frame: moment for moment in told}
    return tuple(
        _example(recording, person_name(k), by_frame[frame][k], seen.grids)
        for k, frames in enumerate(chosen)
        for frame in frames
    )


def told_by_name(
    recording: Recording, seen: SampledMasks, listed: Sequence[ExamplePose]
) -> tuple[ExamplePose, ...] | str:
    """Frames that are listed for several actors, each with where its actor is seen; or why that cannot be told.

    Who is who is told by the places of their rough poses, where these are given, and else by the order in the list; in
    all frames alike, by places and colours.
    """
    by_frame = {people[0].frame: people for people in everybody(seen, recording.up) if people}
    names = tuple(dict.fromkeys(str(example.actor) for example in listed))
    for frame in dict.fromkeys(example.frame for example in listed):
        shown, wanted = len(by_frame.get(frame or 0, ())), sum(example.frame == frame for example in listed)
        if shown != wanted or wanted != len(names):
            return (
                f"frame {frame} is listed for {counted(wanted, 'actor')} of {', '.join(names)}, and "
                f"{counted(shown, 'person', 'people')} stand apart in it; list a frame in which just these stand "
                "apart, for each of them"
            )
    told = told_apart(list(by_frame.values()), recording.fps)
    if len(told) < len(by_frame):
        return f"it is not clear who is who in all frames of {', '.join(names)}; list one frame only"
    order = _order_of_names(names, told, listed)
    places = {moment[0].frame: moment for moment in told}
    return tuple(
        replace(
            _example(recording, str(each.actor), places[each.frame or 0][order[str(each.actor)]], seen.grids),
            initial_pose=each.initial_pose,
        )
        for each in listed
    )


def _order_of_names(
    names: Sequence[str], told: Sequence[Sequence[PersonSeen]], listed: Sequence[ExamplePose]
) -> dict[str, int]:
    """Which of the people is called how: that which is nearest to the places that are given."""
    costs = np.zeros((len(names), len(names)))
    for moment in told:
        for example in listed:
            pose = example.initial_pose
            if example.frame == moment[0].frame and pose is not None and pose.position is not None:
                away = [float(np.linalg.norm(person.place - np.array(pose.position))) for person in moment]
                costs[names.index(str(example.actor))] += away
    if costs.any():
        return dict(zip(names, matched(costs)[0], strict=True))
    return {name: k for k, name in enumerate(names)}


def has_plates(recording: Recording) -> bool:
    """Whether there is a picture of the empty scene for every camera: more cannot be asked for."""
    return set(recording.rig.names) <= set(recording.background)


def _plates_or(given: bool) -> str:
    return "" if given else "give pictures of the empty scene as background/CAMERA.jpg, or "


def too_few_apart(actors: int, counts: Sequence[int], plates: bool = False) -> str:
    """The sentence on frames that show other numbers of people; `plates`: all cameras have one of the empty scene.

    Another number is only recommended where it would not be refused in turn.
    """
    most = most_seen(counts)
    if not most:
        return f"nobody is seen apart from the background; {_plates_or(plates)}{OTHERWISE}"
    shown = "one person" if most == 1 else f"{most} people"
    usual = most != actors and sum(n == most for n in counts) > MOST * len(counts)
    return (
        f"actors={actors}, but {actors} people stand apart in {sum(n == actors for n in counts)} of "
        f"{counted(len(counts), 'frame')}, and {shown} in {sum(n == most for n in counts)}; "
        f"{f'give actors={most}, or ' if usual else ''}{OTHERWISE}"
    )


def everybody(seen: SampledMasks, up: str, count: int = 0) -> list[list[PersonSeen]]:
    """The people in each of some frames; none, where too few cameras show any. `count` as in `people_apart`."""
    cubes = subject_cubes(seen.masks, seen.cameras)
    rows = zip(seen.frames, seen.masks, seen.pictures, cubes, strict=True)

    def of_frame(row: tuple[int, dict[int, Mask], dict[int, Picture], Cube | None]) -> list[PersonSeen]:
        frame, masks, pictures, cube = row
        if cube is None:
            return []
        return people_apart(frame, masks, seen.unknown, pictures, seen.cameras, cube, axis_vector(up), count)

    return in_threads(of_frame, rows, FRAMES_AT_ONCE)


def chosen_frames(shapes: Sequence[Mapping[int, SeenShape]], count: int) -> list[list[int]]:
    """At most `count` frames of each person, ascending, from the shapes of each by frame.

    First those that suit everybody, since tracking may begin there; where these are few, a person's own in addition.
    """
    together = [moment[0].frame for moment in spread_moments(suitable_moments(shapes), count)]
    chosen = []
    for of_person in shapes:
        own = [shape for frame, shape in of_person.items() if shape.agreement > AGREEING and frame not in together]
        chosen.append(sorted([*together, *(shape.frame for shape in spread_choice(own, count - len(together)))]))
    return chosen


def suitable_moments(shapes: Sequence[Mapping[int, SeenShape]]) -> list[Moment]:
    """The frames in which everybody is seen well, from the shapes of each person by frame."""
    frames = sorted(set.intersection(*(set(of_person) for of_person in shapes)))
    moments = [tuple(of_person[frame] for of_person in shapes) for frame in frames]
    return [moment for moment in moments if min(shape.agreement for shape in moment) > AGREEING]


def _shapes(person: Sequence[PersonSeen], seen: SampledMasks, up: str) -> dict[int, SeenShape]:
    """What the silhouettes of one person tell, by frame; cameras in which others hide him show nothing of him."""

    def of_frame(row: tuple[PersonSeen, Cube | None]) -> SeenShape | None:
        one, cube = row
        if cube is None:
            return None
        unknown = {k: seen.unknown[k] & region for k, region in one.regions.items()}
        cameras = {k: seen.cameras[k] for k in one.masks}
        shape = seen_shape(one.frame, one.masks, unknown, cameras, cube, axis_vector(up))
        return None if shape is None else replace(shape, whole=shape.whole * len(cameras) / len(seen.cameras))

    cubes = subject_cubes([one.masks for one in person], seen.cameras, LEAST_BESIDE)
    shapes = in_threads(of_frame, zip(person, cubes, strict=True), FRAMES_AT_ONCE)
    return {shape.frame: shape for shape in shapes if shape is not None}


def _example(recording: Recording, actor: str, person: PersonSeen, grids: Sequence[CellGrid]) -> ExamplePose:
    name = frame_name(person.frame)
    of_cameras = lambda masks: {recording.rig.names[k]: reduced_mask(grids[k].enlarged(m)) for k, m in masks.items()}
    return ExamplePose(name, actor, {}, {}, None, person.frame, of_cameras(person.regions), of_cameras(person.others))
