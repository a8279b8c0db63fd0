"""YAML that people write, read strictly and safely: a complaint names file, key, value and expectation."""

import difflib
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from yaml.composer import ComposerError
from yaml.constructor import ConstructorError, SafeConstructor

from sogjax.errors import InputError, counted
from sogjax.io.files import objection, read_bounded

try:
    from yaml import CSafeLoader as LibyamlLoader
except ImportError:  # PyYAML was built without libyaml
    from yaml import SafeLoader as LibyamlLoader

MAX_BYTES = 1_000_000
"""No person writes a larger file."""
DEEPEST = 100
"""Levels that libyaml is trusted with: it takes more than Python can say sentences about."""
_LARGEST = float(np.finfo(np.float32).max)


@dataclass(frozen=True)
class Entry:
    """A value of a YAML file together with its place in the file."""

    path: Path
    key: str
    """As in `blobs[12].sigma`; empty for the whole file."""
    value: object

    def error(self, expected: str) -> InputError:
        """The complaint that the value is not what was expected."""
        return InputError(f"{self.path}: {self.key or 'the content'} is {_shown(self.value)}, expected {expected}")

    def mapping(self) -> dict[str, "Entry"]:
        """The entries of a mapping with arbitrary names."""
        if not isinstance(self.value, Mapping):
            raise self.error("a mapping (key: value)")
        for key in self.value:
            if not isinstance(key, str):
                raise self.error(f"names as keys; put the key {_shown(key)} in quotes if it is one")
        return {key: Entry(self.path, self._below(key), value) for key, value in self.value.items()}

    def part(self, key: str) -> "Entry":
        """A key of this mapping as a value, to complain about."""
        return Entry(self.path, self._below(key), key)

    def fields_at_least(self, required: Collection[str]) -> dict[str, "Entry"]:
        """The entries of a mapping that may have keys beyond the required ones."""
        entries = self.mapping()
        for key in required:
            if key not in entries:
                needed = ", ".join(required)
                raise InputError(f"{self.path}: {self.key or 'the file'} lacks the key `{key}`; it needs {needed}")
        return entries

    def fields(self, required: Collection[str], optional: Collection[str] = ()) -> dict[str, "Entry"]:
        """The entries of a mapping whose keys are prescribed."""
        known = [*required, *optional]
        entries = self.mapping()
        for key, entry in entries.items():
            if key not in known:
                raise InputError(
                    f"{self.path}: the key {entry.key} is unknown{_nearest(key, known)}; "
                    f"the keys here are {', '.join(known)}"
                )
        return self.fields_at_least(required)

    def given(self, optional: Collection[str], required: Collection[str] = ()) -> dict[str, "Entry"]:
        """The entries of a mapping whose keys are prescribed, without optional ones that are empty."""
        entries = self.fields(required, optional)
        return {key: entry for key, entry in entries.items() if key in required or entry.value is not None}

    def items(self) -> list["Entry"]:
        """The entries of a list."""
        if not isinstance(self.value, list):
            raise self.error("a list")
        return [Entry(self.path, f"{self.key}[{k}]", value) for k, value in enumerate(self.value)]

    def _below(self, key: str) -> str:
        name = key if len(key) <= 60 and key.isprintable() else _shown(key)
        return f"{self.key}.{name}" if self.key else name

    def text(self) -> str:
        """A text that is not empty."""
        if not isinstance(self.value, str) or not self.value.strip():
            raise self.error("a text (in quotes where YAML would read it as something else)")
        return self.value

    def choice(self, options: Collection[str], what: str) -> str:
        """One of the `options`; `what` says what they are."""
        if not isinstance(self.value, str) or self.value not in options:
            few = f" ({', '.join(options)})" if len(options) <= 8 else _nearest(str(self.value), options)
            raise self.error(f"{what}{few}")
        return self.value

    def file_name(self, expected: str | None = None) -> str:
        """A text that may become the name of a file: it leads into no other folder."""
        name = self.text()
        if (wanted := objection(name)) is not None:
            raise self.error(expected or wanted)
        return name

    def whole(self, expected: str, lowest: int | float = -math.inf, highest: int | float = math.inf) -> int:
        """A whole number within limits."""
        if isinstance(self.value, bool) or not isinstance(self.value, int) or not lowest <= self.value <= highest:
            raise self.error(expected)
        return self.value

    def number(self, expected: str = "a finite number", lowest: float = -_LARGEST, highest: float = _LARGEST) -> float:
        """A number within limits that float32 can hold; `1e-3`, which YAML reads as text, is one too."""
        number = _float(self.value)
        if not lowest <= number <= highest:
            raise self.error(expected)
        return number

    def numbers(
        self,
        expected: str = "a list of three finite numbers",
        lowest: float = -_LARGEST,
        highest: float = _LARGEST,
    ) -> list[float]:
        """A list of three numbers within limits."""
        if not isinstance(self.value, list) or len(self.value) != 3:
            raise self.error(expected)
        numbers = [item.number() for item in self.items()]
        if min(numbers) < lowest or max(numbers) > highest:
            raise self.error(expected)
        return numbers


def read_yaml(path: Path) -> Entry:
    """The content of a YAML file of at most `MAX_BYTES`, without aliases and without repeated keys."""
    content = read_bounded(path, MAX_BYTES)
    try:
        return Entry(path, "", _loaded(content))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = f" in line {mark.line + 1}" if mark else ""
        raise InputError(f"{path}: is not valid YAML{line}: {error.problem}") from error
    except (yaml.YAMLError, ValueError) as error:
        raise InputError(f"{path}: is not valid YAML: {' '.join(str(error).split())}") from error
    except RecursionError as error:
        raise InputError(f"{path}: is nested too deeply; give a file written for this purpose") from error


def _loaded(content: bytes) -> object:
    """What YAML says: read by libyaml where it is there, far faster; what it refuses, the other reader says or takes.

    It takes a few things that the other one refuses (a tab behind a colon), and gives the same for what both take.
    """
    if yaml.__with_libyaml__:
        try:
            return yaml.load(content, Loader=_FastLoader)
        except (yaml.YAMLError, ValueError, RecursionError):
            pass  # said by the other one
    return yaml.load(content, Loader=_StrictLoader)


class _UniqueKeys(SafeConstructor):
    """Objects without repeated keys."""

    def construct_mapping(self, node, deep=False):
        seen = set()
        pairs = node.value if isinstance(node, yaml.MappingNode) else []
        keys = [key for key, _ in pairs if isinstance(key, yaml.ScalarNode)]
        for key in keys:
            if key.value in seen:
                problem = f"the key {_shown(key.value)} occurs twice"
                raise ConstructorError(None, None, problem, key.start_mark)
            seen.add(key.value)
        return super().construct_mapping(node, deep)


class _StrictLoader(_UniqueKeys, yaml.SafeLoader):
    """The safe loader without aliases (a few of which can stand for gigabytes) and without repeated keys."""

    def compose_node(self, parent, index):
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark
            raise ComposerError(None, None, "aliases (*name) are not allowed, write the value out", mark)
        return super().compose_node(parent, index)


class _FastLoader(_UniqueKeys, LibyamlLoader):  # pyright: ignore[reportGeneralTypeIssues]
    """The same with libyaml, which gives the same node for an alias as for what it stands for."""

    def get_single_node(self):
        node = super().get_single_node()
        found, left = set[int](), [] if node is None else [(node, 0)]
        while left:
            part, depth = left.pop()
            if id(part) in found or depth > DEEPEST:
                raise yaml.YAMLError("an alias, or nested deeply")
            found.add(id(part))
            if isinstance(part, yaml.CollectionNode):
                below = [each for item in part.value for each in (item if isinstance(item, tuple) else (item,))]
                left += [(each, depth + 1) for each in below]
        return node


def _float(value: object) -> float:
    """The number; NaN where it is none."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return math.nan
    try:
        return float(value)
    except (ValueError, OverflowError):
        return math.nan


def _shown(value: object) -> str:
    """The value for a sentence: short, and never more than one line."""
    if value is None:
        return "empty"
    if isinstance(value, Mapping):
        return "a mapping"
    if isinstance(value, int) and value.bit_length() > 200:
        return "a number with very many digits"
    if isinstance(value, list):
        text = f"[{', '.join(map(_shown, value[:4]))}]"
        return text if len(value) <= 4 and len(text) <= 80 else f"a list of {counted(len(value), 'value')}"
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _nearest(name: str, options: Collection[str]) -> str:
    near: Sequence[str] = difflib.get_close_matches(name, [*options], n=1)
    return f" (did you mean {near[0]!r}?)" if near else ""
