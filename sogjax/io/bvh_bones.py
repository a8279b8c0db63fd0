"""The bones of a BVH file's hierarchy, with their offsets and channels."""

from dataclasses import dataclass
from pathlib import Path

from sogjax.io.text_lines import Lines

HEADER = "HIERARCHY"
MAX_BYTES = 512 * 2**20
"""The motion stands in the same file."""
MAX_CHANNELS = 2000
_EXPECTED = "OFFSET, CHANNELS, JOINT, End Site, { or }"
_CHANNELS = "CHANNELS, their number (at most 6) and their names, such as 3 Zrotation Xrotation Yrotation"


@dataclass
class BvhBone:
    """A ROOT or JOINT of the file; lengths are in its unit."""

    name: str
    parent: int
    """Its place among the bones; -1: a root."""
    offset: list[float]
    channels: tuple[str, ...] = ()
    """In the file's order, such as `Zrotation`."""
    end: list[float] | None = None
    """Where its End Site is, from it."""


def read_bones(path: Path) -> list[BvhBone]:
    """The bones in the file's order, parents before their children.

    Raises:
        InputError: the file cannot be read, or its hierarchy is damaged.
    """
    lines = Lines(path, MAX_BYTES, own_line="{}", until="MOTION")
    if lines.take("the header") != [HEADER]:
        raise lines.error(f"the header {HEADER}")
    bones: list[BvhBone] = []
    while lines.peek()[:1] == ["ROOT"]:
        _read_tree(lines, bones)
    if lines.left:
        lines.take("ROOT or MOTION")
        raise lines.error("ROOT or MOTION")
    return bones


def _read_tree(lines: Lines, bones: list[BvhBone]) -> None:
    """A ROOT and all that is in its braces."""
    above = [_begun(lines, lines.take("ROOT"), bones, -1)]
    while above:
        bone, words = bones[above[-1]], lines.take(_EXPECTED)
        if words == ["}"]:
            above.pop()
        elif words[0] == "CHANNELS" and not bone.channels and above[-1] == len(bones) - 1 and bone.end is None:
            bone.channels = _channels(lines, words[1:])
            if sum(max(len(each.channels), 1) for each in bones) > MAX_CHANNELS:
                raise lines.error(f"at most {MAX_CHANNELS} channels in all")
        elif words[0] == "JOINT":
            above.append(_begun(lines, words, bones, above[-1]))
        elif words == ["End", "Site"] and bone.end is None:
            bone.end = _offset(lines)
            if lines.take("}") != ["}"]:
                raise lines.error("}")
        else:
            raise lines.error(_EXPECTED)


def _begun(lines: Lines, words: list[str], bones: list[BvhBone], parent: int) -> int:
    """Append a bone; returns its place."""
    if len(words) < 2:
        raise lines.error(f"{words[0]} with a name")
    name = "_".join(words[1:]).replace("/", "_").replace("\\", "_")
    bones.append(BvhBone(name, parent, _offset(lines)))
    return len(bones) - 1


def _offset(lines: Lines) -> list[float]:
    """The offset with which everything in braces begins."""
    if lines.take("{") != ["{"]:
        raise lines.error("{")
    words = lines.take("OFFSET")
    if words[0] != "OFFSET" or len(words) != 4:
        raise lines.error("OFFSET and three numbers")
    return lines.numbers(words[1:])


def _channels(lines: Lines, words: list[str]) -> tuple[str, ...]:
    names = tuple(words[1:])
    known = all(name[0] in "XYZ" and name[1:] in ("position", "rotation") for name in names)
    if words[:1] != [str(len(names))] or len(set(names)) < len(names) or not known:
        raise lines.error(_CHANNELS)
    return names
