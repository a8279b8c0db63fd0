"""Which of two lists of names mean the same cameras, where another program named them in its own way."""

import re
from collections.abc import Iterable


def matched_names(wanted: Iterable[str], found: Iterable[str]) -> dict[str, str]:
    """By name of `wanted` the one of `found` that is the same, or holds it or is held by it as whole words.

    Words are runs of letters and numbers without leading zeros: `cam_01` is `Cam1` and a part of `int_cam01_img`, but
    no part of `cam_010`. A name that could mean two others means none.
    """
    wanted, found = [*dict.fromkeys(wanted)], [*dict.fromkeys(found)]
    same = {name: name for name in wanted if name in found}
    words = {name: _words(name) for name in (*wanted, *found)}
    for alike in (lambda a, b: a == b, lambda a, b: _holds(a, b) or _holds(b, a)):
        left = [name for name in wanted if name not in same]
        free = [name for name in found if name not in same.values()]
        pairs = [(a, b) for a in left for b in free if words[a] and words[b] and alike(words[a], words[b])]
        for a, b in pairs:
            if sum(a == first for first, _ in pairs) == 1 and sum(b == second for _, second in pairs) == 1:
                same[a] = b
    return same


def _words(name: str) -> list[str]:
    found = re.findall(r"[^\W\d_]+|[0-9]+", name.lower())
    return [word.lstrip("0") or "0" if word.isdigit() else word for word in found]


def _holds(words: list[str], part: list[str]) -> bool:
    return any(words[k : k + len(part)] == part for k in range(len(words) - len(part) + 1))
