"""The entries of `example_poses` in `recording.yaml`: folders of pictures, or frames of the videos."""

from dataclasses import dataclass

from sogjax.data.file_names import objection
from sogjax.data.initial_pose import InitialPose, parse_initial_pose
from sogjax.data.yaml_entry import Entry

_OPTIONAL = ("actor", "initial_pose")


@dataclass(frozen=True)
class ExampleSettings:
    """An entry of `example_poses`."""

    name: str
    actor: str | None = None
    initial_pose: InitialPose | None = None
    frame: int | None = None
    """Of the videos, in the recording's own numbering; None: the pictures lie in the folder `name`."""


def read_examples(entry: Entry) -> tuple[ExampleSettings, ...]:
    """The list `example_poses`: frame numbers, and mappings with the `name` of a folder or a `frame`.

    Raises:
        InputError: an entry of another kind, or a folder or a frame that is listed twice.
    """
    examples: list[ExampleSettings] = []
    for item in entry.items():
        example = _example(item)
        if example.name in [other.name for other in examples]:
            key = "name" if example.frame is None else "frame"
            repeated = item.mapping()[key] if isinstance(item.value, dict) else item
            raise repeated.error("each folder and each frame once")
        examples.append(example)
    return tuple(examples)


def frame_name(frame: int) -> str:
    """How the example pose that a frame of the videos shows is called."""
    return f"frame_{frame}"


def _example(entry: Entry) -> ExampleSettings:
    if not isinstance(entry.value, dict):
        frame = _frame(entry)
        return ExampleSettings(frame_name(frame), frame=frame)
    from_video = "frame" in entry.value
    fields = entry.fields(("frame",) if from_video else ("name",), _OPTIONAL)
    given = {key: value for key, value in fields.items() if value.value is not None}
    frame = _frame(fields["frame"]) if from_video else None
    return ExampleSettings(
        name=_folder(fields["name"]) if frame is None else frame_name(frame),
        actor=_actor(given["actor"]) if "actor" in given else None,
        initial_pose=parse_initial_pose(given["initial_pose"]) if "initial_pose" in given else None,
        frame=frame,
    )


def _frame(entry: Entry) -> int:
    if isinstance(entry.value, bool) or not isinstance(entry.value, int):
        raise entry.error("the number of a frame of the videos, or {name: FOLDER} or {frame: NUMBER} with its keys")
    return entry.value


def _folder(entry: Entry) -> str:
    name = entry.text()
    if objection(name) is not None:
        raise entry.error("the name of a folder in example_poses/")
    return name


def _actor(entry: Entry) -> str:
    name = entry.text()
    if (wanted := objection(name)) is not None:
        raise entry.error(wanted)
    return name
