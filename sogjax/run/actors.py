"""The pass that makes the actors: from files, from example poses or frames of the videos, or from keypoints."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import chain, count, islice
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.actor.make import MadeActor, Making, subjects_of
from sogjax.actor.posed_examples import overlap_of
from sogjax.actor.silhouettes import PosedPictures, Progress, SharedFrames, load_all_pictures
from sogjax.actor.together import made_together
from sogjax.energy.term import Terms
from sogjax.errors import InputError
from sogjax.io.actor_file import load_body, save_body
from sogjax.io.background_cache import background_origin
from sogjax.io.npz_file import float_array, read_npz, save_npz, text_array
from sogjax.io.recording import Recording
from sogjax.io.source import fingerprint
from sogjax.model.body import Body
from sogjax.model.cores import in_threads
from sogjax.run.background import Background, learn_background
from sogjax.run.build import color_space_and_radius, energy_terms
from sogjax.run.clip import Clip
from sogjax.run.example_frames import check_actors, with_examples
from sogjax.run.example_people import person_name
from sogjax.run.fingerprint import digest
from sogjax.run.keypoint_actor import keypoint_actor, with_rough_poses
from sogjax.run.recordings import body_named, check_scale, file_list
from sogjax.run.shared import SHARED
from sogjax.run.terminal import progress, say
from sogjax.scene.background import BackgroundImage
from sogjax.settings.method import ColorConfig, EnergyConfig, ImagesConfig
from sogjax.settings.run import ActorConfig, TrackConfig

FILE = "actors.npz"
Report = Callable[[Sequence[MadeActor]], object]
"""Takes how the actors were made, with the pictures they were made of, which are not held any longer then."""


@dataclass(frozen=True)
class KnownFrame:
    """A frame of the videos that every actor was made of, so that all poses in it are known."""

    frame: int
    """The recording's number."""
    pose: Float[np.ndarray, "dof"]
    """The pose of all actors, upright in the recording's world."""
    agreement: float
    """`MadeActor.suitability` of the actor for whom it is least."""


@dataclass(frozen=True)
class Actors:
    """The actors of a run, each in its own upright frame."""

    bodies: tuple[Body, ...]
    known_frames: tuple[KnownFrame, ...] = ()
    doubts: tuple[str, ...] = ()
    """Why each may be of the wrong sizes; "" where nothing says so. None at all: nothing does."""
    unlike: tuple[str, ...] = ()
    """Which limbs of each were not found in the example poses; "" and none at all as for `doubts`."""
    overlap: float = 1.0
    """How well masks and body agree (mean IoU) in the frames that they are made of, of the one of whom it is least."""

    def save(self, folder: Path) -> None:
        """Keep them exactly in a run's folder; actor files hold rounded colours."""
        arrays: dict[str, np.ndarray] = {}
        for k, body in enumerate(self.bodies):
            save_body(folder / f"actor_{k}.yaml", body)
            arrays |= {f"{k}_{n}": np.asarray(leaf) for n, leaf in enumerate(jax.tree.leaves(body))}
        for k, known in enumerate(self.known_frames):
            arrays |= {f"known_{k}": known.pose, f"where_{k}": np.array([known.frame, known.agreement])}
        for kind, sentences in (("doubt", self.doubts), ("unlike", self.unlike)):
            arrays |= {f"{kind}_{k}": np.array(sentence) for k, sentence in enumerate(sentences)}
        save_npz(folder / FILE, arrays | {"overlap": np.array(self.overlap)})

    @classmethod
    def load(cls, folder: Path) -> "Actors | None":
        """The actors that were kept, if they were.

        Raises:
            InputError: what was kept does not fit together.
        """
        file = folder / FILE
        if not file.is_file():
            return None
        exact, bodies = read_npz(file), []
        while (path := folder / f"actor_{len(bodies)}.yaml").is_file():
            leaves, structure = jax.tree.flatten(load_body(path))
            kept = [_leaf(file, exact.get(f"{len(bodies)}_{n}"), leaf) for n, leaf in enumerate(leaves)]
            bodies.append(jax.tree.unflatten(structure, kept))
        said = lambda kind: tuple(
            str(text_array(file, exact, name, ())) for k in range(len(bodies)) if (name := f"{kind}_{k}") in exact
        )
        known = []
        for k in count():
            if f"known_{k}" not in exact:
                overlap = float(float_array(file, exact, "overlap", ())) if "overlap" in exact else 1.0
                return cls(tuple(bodies), tuple(known), said("doubt"), said("unlike"), overlap)
            frame, agreement = exact[f"where_{k}"].tolist()
            known.append(KnownFrame(int(frame), exact[f"known_{k}"], agreement))
        raise AssertionError


def _leaf(path: Path, kept: np.ndarray | None, like: Array) -> Array:
    """An array of an actor, with the shape and type of `like`."""
    if kept is None or (kept.shape, kept.dtype) != (like.shape, like.dtype):
        raise InputError(f"{path}: does not match the actor beside it; start over with overwrite=true")
    return jnp.asarray(kept)


@dataclass(frozen=True)
class ActorRequest:
    """Which actors are wanted, and what they may be made of."""

    clip: Clip
    background: Callable[[], Background]
    """Tells the background, which is only learnt where masks need it."""
    files: Sequence[Path] | None = None
    """Actor files; None: the actors are made."""
    body: str = "human"
    """The body that they are made from: the name of one that is shipped, or a file."""
    color: ColorConfig = field(default_factory=ColorConfig)
    number: int | None = None
    """How many people the videos show, where neither files nor example poses say so; None: one."""
    subjects: tuple[str | None, ...] | None = None
    """The subjects of example poses that are made, None among them stands for the only one; None: all."""
    symmetric: bool = True
    """Whether left and right limbs have the same lengths and sizes."""

    @classmethod
    def of_track(cls, clip: Clip, config: TrackConfig) -> "ActorRequest":
        """The actors with the settings of `sogjax track`."""
        files = None if config.actor is None else file_list(config.actor)
        background = lambda: learn_background(clip, config.images.background, config.images.cache)
        return cls(clip, background, files, config.body, config.color, config.actors)

    @classmethod
    def from_config(cls, recording: Recording, config: ActorConfig) -> "ActorRequest":
        """One actor with the settings of `sogjax actor`.

        Raises:
            InputError: several people are to be found, and none of them is chosen.
        """
        if not recording.example_poses and (config.actors or 1) > 1:
            people = [*map(person_name, range(config.actors or 1))]
            if config.subject not in people:
                given = "" if config.subject is None else f", not {config.subject}"
                raise InputError(f"actors={config.actors}: choose one of {', '.join(people)} with subject=NAME{given}")
        images = ImagesConfig()
        clip = Clip(recording, recording.frames, images.depth)
        background = lambda: learn_background(clip, images.background)
        made_of = {"body": config.body, "color": config.color, "number": config.actors, "symmetric": config.symmetric}
        return cls(clip, background, subjects=(config.subject,), **made_of)

    @property
    def recording(self) -> Recording:
        """The recording that shows the actors."""
        return self.clip.recording

    @property
    def color_space(self) -> str:
        """The space in which colours are averaged."""
        return color_space_and_radius(self.color)[0]

    @property
    def terms(self) -> Terms:
        """The energy with which example poses are refined: the usual one."""
        return energy_terms(EnergyConfig())


def make_actors(request: ActorRequest, report: Report = lambda _: None) -> Actors:
    """The actors of files, or else made of pictures, or else of keypoints.

    `report` is told how they were made of pictures; not again where an earlier run of the process made them.

    Raises:
        InputError: an invalid actor file, two actors with one name, unsuitable example poses, or videos that none can
            be taken from.
    """
    if request.files is not None:
        return _of_files(request, request.files)
    return SHARED.get(actors_key(request), lambda: new_actors(request, report))


def new_actors(request: ActorRequest, report: Report = lambda _: None) -> Actors:
    """The actors made of pictures, or else of keypoints, whether an earlier run of the process made them or not.

    Raises:
        InputError: as `make_actors`.
    """
    check_scale(request.recording, [body_named(request.body)])
    try:
        made = actors_of_pictures(request)
    except InputError as error:
        if (actor := _of_keypoints(request, str(error))) is None:
            raise
        return Actors((actor,))
    doubts, unlike = (tuple(said or "" for said in sentences) for sentences in zip(*map(_doubts, made), strict=True))
    reasons = "; ".join(filter(None, (*doubts, *unlike)))
    if reasons and (actor := _of_keypoints(request, reasons)) is not None:
        return Actors((actor,))
    report(made)
    overlap = min(overlap_of(each.upright_body, each.estimate.poses, each.pictures, each.rig) for each in made)
    return Actors(tuple(actor.body for actor in made), known_frames(made), doubts, unlike, overlap)


def _doubts(actor: MadeActor) -> tuple[str | None, str | None]:
    return actor.doubt, actor.unlike


def _of_files(request: ActorRequest, files: Sequence[Path]) -> Actors:
    bodies, listed = [load_body(path) for path in files], ", ".join(map(str, files))
    names = [body.name for body in bodies]
    for k, body in enumerate(bodies):
        if any(_alike(body, other) for other in bodies[:k]):
            raise InputError(f"actor={listed}: two of these are the same actor; give one file for each person")
    if len(set(names)) < len(names):
        raise InputError(
            f"actor={listed}: two actors are named {max(names, key=names.count)!r}; give each its own `name`"
        )
    check_actors(request.recording, request.number, len(bodies))
    check_scale(request.recording, bodies)
    return Actors(tuple(bodies))


def _alike(one: Body, other: Body) -> bool:
    """Whether two bodies of one size, shape and colours are one person twice, whatever they are called."""
    parts = lambda body: (body.blob_colors, body.blob_sigmas, body.skeleton.offsets)
    return one.blob_colors.shape == other.blob_colors.shape and all(map(np.array_equal, parts(one), parts(other)))


def actors_of_pictures(request: ActorRequest) -> list[MadeActor]:
    """The actors of the recording's example poses, or of frames of its videos where it has none.

    Raises:
        InputError: unsuitable example poses, or videos of which no frames can be taken.
    """
    start = body_named(request.body)
    recording, learnt, best = with_examples(request.clip, request.background, request.number)
    recording = with_rough_poses(recording, start)
    subjects = subjects_of(recording) if request.subjects is None else request.subjects
    makings = [_making(request, recording, start, subject, best) for subject in subjects]
    shared, examples = SharedFrames(), [making.examples for making in makings]
    loaded = iter(load_all_pictures(recording, [*chain(*examples)], learnt, shared, progress))
    pictures = [[*islice(loaded, len(of_actor))] for of_actor in examples]
    if len(makings) == 1:
        shared.masks.clear()  # nobody else is told by them
    make = lambda each: each[0].made(request.terms, each[1], _progress_of(each[0].subject))
    made = in_threads(make, zip(makings, pictures, strict=True))
    if len(makings) > 1:
        made = made_together(makings, made, _of_everybody(recording, made, learnt, shared))
    for making, actor in zip(makings, made, strict=True):
        for said in actor.doubtful:
            making.report(f"warning: {said}")
    return made


def _making(request: ActorRequest, recording: Recording, start: Body, subject: str | None, best: int | None) -> Making:
    label = "actor" if subject is None else f"actor {subject}"
    said = lambda stage: say(f"{label}: {stage}")
    return Making.of(recording, start, subject, request.color_space, request.symmetric, best=best, report=said)


def _progress_of(subject: str | None) -> Progress:
    """Bars that say whose they are, since several actors are made beside each other."""
    return lambda items, total, label: progress(items, total, label if subject is None else f"{label} of {subject}")


def _of_everybody(
    recording: Recording,
    made: Sequence[MadeActor],
    learnt: Sequence[BackgroundImage] | None,
    shared: SharedFrames,
) -> dict[str, PosedPictures]:
    """The masks of all people in the frames of the videos that show several actors, by the names of the examples."""
    used = {name for actor in made for name in actor.frames}
    examples = {example.name: example for example in recording.example_poses if example.within and example.name in used}
    everybodys = [example.of_everybody(recording.rig.names) for example in examples.values()]
    return dict(zip(examples, load_all_pictures(recording, everybodys, learnt, shared), strict=True))


def known_frames(made: Sequence[MadeActor]) -> tuple[KnownFrame, ...]:
    """The frames of the videos that every actor was made of."""
    shared = [name for name in made[0].frames if all(name in actor.frames for actor in made)]
    return tuple(
        KnownFrame(
            frame=made[0].frames[name],
            pose=np.concatenate([np.asarray(actor.example_poses[name]) for actor in made]),
            agreement=min(actor.suitability(name) for actor in made),
        )
        for name in shared
    )


def _of_keypoints(request: ActorRequest, reason: str) -> Body | None:
    """The actor of keypoints beside the videos, where pictures do not make a good one for a reason.

    None: there are example poses, several actors, or no keypoints that tell.
    """
    if request.recording.example_poses or request.number not in (None, 1):
        return None
    start = body_named(request.body)
    actor = keypoint_actor(request.recording, start, request.color_space, request.symmetric)
    if actor is not None:
        say(f"the actor is made of keypoints and of colours at the posed body, as outlines do not serve ({reason})")
    return actor


def actors_key(request: ActorRequest) -> str:
    """Everything that made actors depend on."""
    recording = request.recording
    pictures = [
        [
            *(example.name, example.actor, example.frame, str(example.initial_pose)),
            *([name, fingerprint(path)] for files in (example.images, example.masks) for name, path in files.items()),
        ]
        for example in recording.example_poses
    ]
    return json.dumps(
        [
            *("actors", str(recording.path.resolve()), background_origin(recording), pictures),
            *({name: fingerprint(path) for name, path in recording.background.items()},),
            *({name: fingerprint(path) for name, path in recording.occluders.items()},),
            *(digest(body_named(request.body)), request.color_space, request.number, request.subjects),
            request.symmetric,
        ]
    )
