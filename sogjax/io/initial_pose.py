"""`initial_pose.yaml`: rough poses of the subjects in frame 0, as a person writes them down."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from sogjax.errors import InputError
from sogjax.io.yaml_entry import Entry, read_yaml

_KEYS = ("pose", "position", "heading", "landmarks")


@dataclass(frozen=True)
class PoseDescription:
    """A rough pose: a named or listed pose at a place, roughly known points, or both."""

    pose: str | dict[str, float] | None = None
    """The name of one of the body's poses, or values of degrees of freedom (radians, metres)."""
    position: tuple[float, float, float] | None = None
    """Where the root is, metres, world."""
    heading: float | None = None
    """Degrees about the world's vertical."""
    landmarks: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    """Roughly known points, metres, world."""


def load_initial_poses(path: Path, actors: Sequence[str]) -> dict[str, PoseDescription]:
    """The initial pose of each of `actors`; with one actor the file may be its pose alone. Others are left out.

    Raises:
        InputError: no such file, an actor is missing, or a value is wrong.
    """
    poses = read_initial_poses(path)
    if isinstance(poses, PoseDescription):
        if len(actors) == 1:
            return {actors[0]: poses}
        raise InputError(
            f"{path}: is the pose of one actor, but there are {len(actors)}; "
            f"make it a mapping of the names {', '.join(actors)} to their poses"
        )
    for actor in actors:
        if actor not in poses:
            raise InputError(f"{path}: has no pose for the actor {actor!r}, only for: {', '.join(poses)}; add it")
    return {actor: poses[actor] for actor in actors}


def read_initial_poses(path: Path) -> PoseDescription | dict[str, PoseDescription]:
    """What the file holds: one pose, or a mapping of actor names to poses."""
    entry = read_yaml(path)
    actors = entry.mapping()
    several = actors and all(name not in _KEYS and isinstance(actor.value, dict) for name, actor in actors.items())
    if several:
        return {name: parse_initial_pose(actor) for name, actor in actors.items()}
    return parse_initial_pose(entry)


def parse_initial_pose(entry: Entry) -> PoseDescription:
    """The pose that is written in an entry of a YAML file."""
    given = entry.given(_KEYS)
    if not given.keys() & {"pose", "position", "landmarks"}:
        raise entry.error("'pose' and 'position', or 'landmarks'")
    landmarks = given["landmarks"].mapping() if "landmarks" in given else {}
    return PoseDescription(
        pose=_pose(given["pose"]) if "pose" in given else None,
        position=_point(given["position"]) if "position" in given else None,
        heading=given["heading"].number("degrees") if "heading" in given else None,
        landmarks={name: _point(landmark) for name, landmark in landmarks.items()},
    )


def _pose(entry: Entry) -> str | dict[str, float]:
    if isinstance(entry.value, dict):
        return {name: dof.number() for name, dof in entry.mapping().items()}
    return entry.text()


def _point(entry: Entry) -> tuple[float, float, float]:
    x, y, z = entry.numbers("three finite numbers [x, y, z] in metres")
    return x, y, z
