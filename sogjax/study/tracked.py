"""Recordings tracked and evaluated without results on disk, and actors that are made once and kept."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from sogjax.io.actor_file import load_body, save_body
from sogjax.model.body import Body
from sogjax.run.actors import ActorRequest, make_actors
from sogjax.run.background import learn_background
from sogjax.run.clip import Clip
from sogjax.run.judge import compared
from sogjax.run.recordings import opened
from sogjax.run.result import RunResult
from sogjax.run.track import opened_clip, track_recording
from sogjax.settings.compose import track_config
from sogjax.settings.method import ImagesConfig


def track_folder(folder: Path, overrides: Sequence[str] = ()) -> RunResult:
    """Track a recording with overrides of the track config, and evaluate it where there is ground truth."""
    config = track_config(overrides, recording=folder)
    recording = opened(config.recording, config.cameras)
    actors = make_actors(ActorRequest.of_track(opened_clip(recording, config), config))
    result = track_recording(recording, actors.bodies, config).result_so_far
    result.evaluation = compared(recording, result.motions)
    return result


def kept_actors(folder: Path, source: Path, body: str = "human") -> list[Body]:
    """The actors that a folder holds, else made of a recording's example poses with all cameras; kept all or none.

    Raises:
        InputError: the example poses are unsuitable, or the folder cannot be written.
    """
    if not folder.is_dir():
        recording, images = opened(str(source)), ImagesConfig()
        clip = Clip(recording, recording.frames, images.depth)
        request = ActorRequest(clip, lambda: learn_background(clip, images.background), body=body)
        _keep(folder, make_actors(request).bodies)
    return [load_body(path) for path in sorted(folder.glob("*.yaml"))]


def _keep(folder: Path, actors: Sequence[Body]) -> None:
    folder.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=f".{folder.name[:80]}.", suffix=".tmp", dir=folder.parent) as beside:
        whole = Path(beside) / "actors"
        for number, actor in enumerate(actors):
            save_body(whole / f"{number}_{actor.name}.yaml", actor)
        try:
            whole.rename(folder)
        except OSError:
            if not folder.is_dir():  # else another process was faster
                raise
