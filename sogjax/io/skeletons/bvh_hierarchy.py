"""The hierarchy of a BVH file: every channel becomes a one-axis joint with a degree of freedom of its own."""

from pathlib import Path

from sogjax.io.actor_rows import WORLD
from sogjax.io.skeletons.rows import MAX_ROWS, SkeletonRows, attach_blobs
from sogjax.io.text_lines import Lines

HEADER = "HIERARCHY"
MAX_BYTES = 256 * 2**20
"""The motion stands in the same file."""

_KINDS = {"position": "prismatic", "rotation": "revolute"}
_EXPECTED = "OFFSET, CHANNELS, JOINT, End Site, { or }"


def read_bvh_hierarchy(path: Path) -> SkeletonRows:
    """The skeleton of a BVH file, with blobs along its bones and a landmark at every joint."""
    lines = Lines(path, MAX_BYTES, own_line="{}", until="MOTION")
    if lines.take("the header") != [HEADER]:
        raise lines.error(f"the header {HEADER}")
    rows = SkeletonRows(path.stem)
    while lines.peek()[:1] == ["ROOT"]:
        _read_tree(lines, rows)
    if lines.left:
        lines.take("ROOT or MOTION")
        raise lines.error("ROOT or MOTION")
    attach_blobs(rows)
    return rows


class _Bone:
    """A bone that is being read: its last one-axis joint, once its channels are known."""

    def __init__(self, name: str, parent: str):
        self.name, self.parent = name, parent
        self.offset: list[float] | None = None
        self.last: str | None = None
        self.is_end = False


def _read_tree(lines: Lines, rows: SkeletonRows) -> None:
    """A ROOT and all that is in its braces."""
    bones = [_begun(lines, lines.take("ROOT"), WORLD)]
    while bones:
        words = lines.take(_EXPECTED)
        bone = bones[-1]
        if words == ["}"]:
            _close(lines, rows, bones.pop())
        elif words[0] == "OFFSET" and len(words) == 4 and bone.offset is None:
            bone.offset = lines.numbers(words[1:])
        elif words[0] == "CHANNELS" and bone.offset is not None and bone.last is None and not bone.is_end:
            _add_joints(lines, rows, bone, words[1:])
        elif words[0] == "JOINT" and bone.offset is not None and not bone.is_end:
            if bone.last is None:
                _add_joints(lines, rows, bone, ["0"])
            bones.append(_begun(lines, words, str(bone.last)))
        elif words == ["End", "Site"] and bone.last is not None:
            bones.append(_begun(lines, words, bone.last))
            bones[-1].is_end = True
        else:
            raise lines.error(_EXPECTED)


def _begun(lines: Lines, words: list[str], parent: str) -> _Bone:
    if len(words) < 2:
        raise lines.error(f"{words[0]} with a name")
    bone = _Bone("_".join(words[1:]).replace("/", "_").replace("\\", "_"), parent)
    if lines.take("{") != ["{"]:
        raise lines.error("{")
    return bone


def _close(lines: Lines, rows: SkeletonRows, bone: _Bone) -> None:
    if bone.offset is None:
        raise lines.error("OFFSET before }")
    if bone.is_end:
        rows.ends[bone.parent] = bone.offset
    elif bone.last is None:
        _add_joints(lines, rows, bone, ["0"])


def _add_joints(lines: Lines, rows: SkeletonRows, bone: _Bone, words: list[str]) -> None:
    """One joint per channel, positions first: BVH moves a bone before turning it, in any order of channels."""
    expected = "CHANNELS, their number (at most 6) and their names, such as 3 Zrotation Xrotation Yrotation"
    channels = words[1:]
    if not words or words[0] not in "0123456" or int(words[0]) != len(channels) or len(set(channels)) < len(channels):
        raise lines.error(expected)
    parent, offset = bone.parent, bone.offset or [0.0] * 3
    for channel in sorted(channels, key=lambda channel: not channel.endswith("position")):
        kind = _KINDS.get(channel[1:])
        if kind is None or channel[0] not in "XYZ":
            raise lines.error(expected)
        axis = channel[0].lower()
        name = f"{bone.name}_{'t' if kind == 'prismatic' else 'r'}{axis}"
        rows.add_joint(name, parent, offset, axis, kind)
        rows.dofs.append({"name": name, "limits": "none", "joints": {name: 1.0}})
        parent, offset = name, [0.0] * 3
    if not channels:
        parent = f"{bone.name}_fixed"
        rows.add_joint(parent, bone.parent, offset, "x", "revolute")
    bone.last = parent
    rows.landmarks.append({"name": bone.name, "joint": parent, "offset": [0.0] * 3})
    if len(rows.joints) > MAX_ROWS:
        raise lines.error(f"at most {MAX_ROWS} channels in all")
