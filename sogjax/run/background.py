"""The pass that learns the background: photographs of the empty scene, else what the clip itself shows, else none."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sogjax.errors import InputError
from sogjax.io.background_cache import Arrays, background_origin, kept_background
from sogjax.io.npz_file import bool_array, float_array, int_array, read_npz, save_npz, text_array
from sogjax.io.recording import Recording
from sogjax.io.source import fingerprint
from sogjax.model.compiled import compiled_hastily
from sogjax.run.clip import Clip, SampleKind
from sogjax.run.clip_learning import UnsuitableError, learnt_from
from sogjax.run.plates import fitted_plates, say_plates, unseen_background, with_example_plates
from sogjax.run.shared import SHARED
from sogjax.run.terminal import say
from sogjax.scene.background import BackgroundImage, Origin, stack_background
from sogjax.scene.cells import CellGrid
from sogjax.scene.foreground import BackgroundModel

CHOICES = ("auto", "pictures", "clip", "none")
FILE = "background.npz"
MUCH_UNKNOWN = 0.015
"""Share of the pictures from which on more is looked for, and the background learnt again; a subject covers some 0.05
of them."""
_model = compiled_hastily(lambda cells: BackgroundModel.from_background(cells))
_ORIGINS: tuple[Origin, ...] = ("picture", "clip")


@dataclass(frozen=True)
class Background:
    """What is known of the empty scene."""

    cameras: tuple[BackgroundImage, ...] | None
    """The background of every camera; None: nothing is known."""
    reason: str = ""
    """Why nothing is known, with the remedy."""

    @property
    def is_learnt(self) -> bool:
        """Whether it was learnt from the clip, for some camera."""
        return self.cameras is not None and any(camera.origin == "clip" for camera in self.cameras)

    def model(self, grids: Sequence[CellGrid]) -> BackgroundModel | None:
        """What the cells of frames are compared with; None: nothing is known."""
        if self.cameras is None:
            return None
        return _model(stack_background(self.cameras, grids))

    def required(self) -> tuple[BackgroundImage, ...]:
        """The background of every camera.

        Raises:
            InputError: nothing is known; the message says why.
        """
        if self.cameras is None:
            raise InputError(self.reason)
        return self.cameras

    def save(self, folder: Path) -> None:
        """Keep it in a run's folder."""
        arrays = {"reason": np.array(self.reason)}
        for k, camera in enumerate(self.cameras or ()):
            arrays |= {f"{k}.picture": camera.picture, f"{k}.spread": camera.spread, f"{k}.known": camera.known}
            arrays |= {f"{k}.learnt": np.array(camera.origin == "clip"), f"{k}.furnished": np.array(camera.furnished)}
        save_npz(folder / FILE, arrays, packed=False)

    @classmethod
    def load(cls, folder: Path) -> "Background | None":
        """What was kept, if it was.

        Raises:
            InputError: what was kept does not fit together.
        """
        path = folder / FILE
        if not path.is_file():
            return None
        arrays = read_npz(path)
        reason = str(text_array(path, arrays, "reason", ()))
        numbers = range(len({key.partition(".")[0] for key in arrays if "." in key}))
        return cls(tuple(_kept_camera(path, arrays, f"{k}.") for k in numbers) or None, reason)


def _kept_camera(path: Path, arrays: Arrays, prefix: str) -> BackgroundImage:
    picture = int_array(path, arrays, prefix + "picture", (None, None, 3)).astype(np.uint8)
    spread = float_array(path, arrays, prefix + "spread", picture.shape[:2])
    known = bool_array(path, arrays, prefix + "known", picture.shape[:2])
    learnt = bool(bool_array(path, arrays, prefix + "learnt", ()))
    key = prefix + "furnished"
    furnished = key in arrays and bool(bool_array(path, arrays, key, ()))  # which earlier versions did not keep
    return BackgroundImage(picture, spread, known, _ORIGINS[learnt], furnished)


def learn_background(clip: Clip, choice: str, cache: str | None = None, more: Sequence[SampleKind] = ()) -> Background:
    """The background of every camera, as `images.background` asks for.

    With `auto`, photographs count where there are any, else the clip, if it is suitable; where that leaves much open,
    photographs of example poses fill it outside of their masks.

    Args:
        clip: its recording has the photographs, or is learnt from.
        choice: one of `CHOICES`.
        cache: the folder of `images.cache`, where learnt backgrounds are kept then.
        more: samples that will be needed too, and are taken on the way.

    Raises:
        InputError: pictures are asked for and missing, the clip is asked for and unsuitable, a video cannot be read,
            or the cache's folder cannot be written.
    """
    recording = clip.recording
    if choice not in CHOICES:
        raise InputError(f"images.background={choice}: no such choice; use one of {', '.join(CHOICES)}")
    missing = [name for name in recording.rig.names if name not in recording.background]
    if choice == "pictures" and missing:
        raise InputError(
            f"{recording.path}: images.background=pictures, but background/ has no picture of "
            f"{', '.join(missing)}; add it, or set images.background=auto to learn it from the clip"
        )
    if choice == "none":
        return Background(None, "images.background=none")
    if choice == "pictures":
        return _of_plates(clip, choice, cache, more)
    if choice == "auto" and recording.background:
        return _with_examples(clip, _of_plates(clip, choice, cache, more))
    learnt = _of_clip(clip, cache, more)
    if choice == "auto":
        return _with_examples(clip, learnt)
    if choice == "clip" and learnt.cameras is None:
        raise InputError(
            f"{recording.path}: images.background=clip, but {learnt.reason}, or set images.background=none"
        )
    return learnt


def _of_plates(clip: Clip, choice: str, cache: str | None, more: Sequence[SampleKind]) -> Background:
    """The background from photographs; from the clip, if it tells, where these do not fit, or there are none.

    Also where something stands in one that the videos do not show: somebody in it is seldom told as a whole.
    """
    recording = clip.recording
    files = [(name, str(path), fingerprint(path)) for name, path in recording.background.items()]
    key = [
        "plates",
        choice,
        *files,
        background_origin(recording),
        [clip.numbers.start, clip.numbers.stop, clip.numbers.step],
    ]

    def of_plates() -> Background:
        plates = fitted_plates(clip, more)
        unfit = say_plates(clip, plates, choice)
        known = {name: BackgroundImage.from_plate(plate) for name, plate in plates.items() if name not in unfit}
        others = [name for name in recording.rig.names if name not in known]
        partly = [name for name in known if plates[name].other and choice == "auto"]
        if others or partly:
            found = _of_clip(clip, cache, ())
            _say_learnt(recording, others, partly, found)
            learnt = found.cameras or tuple(unseen_background(recording, name) for name in recording.rig.names)
            for name, own in zip(recording.rig.names, learnt, strict=True):
                plate = known.get(name, own)
                known[name] = own.filled(plate) if name in partly else plate.filled(own)
        return Background(tuple(known[name] for name in recording.rig.names))

    return SHARED.get(json.dumps(key), of_plates)


def _say_learnt(recording: Recording, others: Sequence[str], partly: Sequence[str], learnt: Background) -> None:
    """Say where photographs are not what is known of the empty scene."""
    done = f"stays unknown, since {learnt.reason}" if learnt.cameras is None else "is learnt from the clip"
    if missing := [name for name in others if name not in recording.background]:
        say(f"warning: {recording.path}: background/ has no picture of {', '.join(missing)}; add it, as CAMERA.jpg")
    if others:
        say(f"the background of {', '.join(others)} {done}")
    if partly:
        say(f"somebody may stand in the pictures of {', '.join(partly)}: the background there {done}")


def _with_examples(clip: Clip, learnt: Background) -> Background:
    """What was learnt, filled by the photographs of example poses where it leaves much open."""
    if learnt.cameras is not None and 1.0 - np.mean([camera.known.mean() for camera in learnt.cameras]) < MUCH_UNKNOWN:
        return learnt
    cameras, added = with_example_plates(clip, learnt.cameras)
    if not added:
        return learnt
    say(f"pictures of example poses, outside of their masks, show {added:.0%} more of the empty scene")
    return Background(cameras)


def said_if_none(clip: Clip, choice: str, background: Background) -> Background:
    """The background; where the user left the choice and there is none, that is said."""
    if choice == "auto" and background.cameras is None:
        say(f"{clip.recording.path}: no background is used, since {background.reason}")
    return background


def _of_clip(clip: Clip, cache: str | None, more: Sequence[SampleKind]) -> Background:
    """The background from the folder where these are kept, or else learnt now; the runs of a process share it."""
    recording = clip.recording

    def kept_or_learnt() -> Background:
        try:
            arrays = kept_background(cache, recording, lambda: _arrays(clip, learnt_from(clip, more=more)), say)
        except UnsuitableError as unsuitable:
            return Background(None, str(unsuitable))
        return Background(tuple(_of_arrays(arrays, name) for name in recording.rig.names))

    key = json.dumps(["clip", str(recording.path.resolve()), cache, background_origin(recording)])
    return SHARED.get(key, kept_or_learnt)


def _arrays(clip: Clip, cameras: Sequence[BackgroundImage]) -> Arrays:
    parts = ("picture", "spread", "known", "furnished")
    named = zip(clip.recording.rig.names, cameras, strict=True)
    return {f"{name}.{part}": np.asarray(getattr(camera, part)) for name, camera in named for part in parts}


def _of_arrays(arrays: Arrays, name: str) -> BackgroundImage:
    picture, spread, known = (arrays[f"{name}.{part}"] for part in ("picture", "spread", "known"))
    return BackgroundImage(picture, spread, known, "clip", bool(arrays[f"{name}.furnished"]))
