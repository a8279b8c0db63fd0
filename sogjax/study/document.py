"""A report as a list of sections, written as Markdown with pictures beside it, and as one HTML file."""

import base64
import html
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import markdown

from sogjax.io.files import write_file


@dataclass(frozen=True)
class Picture:
    """A picture of a report."""

    name: str
    """The name of its file, with the ending `.png` or `.jpg`."""
    content: bytes
    caption: str


@dataclass(frozen=True)
class Section:
    """A heading with paragraphs and tables in Markdown, then pictures."""

    title: str
    parts: Sequence[str] = ()
    """Paragraphs, lists (lines that begin with `- `), tables (with `|`), code between lines of three backticks."""
    pictures: Sequence[Picture] = field(default=())


def write_markdown(path: Path, title: str, sections: Sequence[Section]) -> list[Path]:
    """Write a report, its pictures in a folder beside it that has the report's name; the files.

    Raises:
        InputError: the folder cannot be written.
    """
    folder = path.with_suffix("")
    lines, files = [f"# {title}"], [path]
    for section in sections:
        lines += [f"## {section.title}", *section.parts]
        for picture in section.pictures:
            files.append(folder / picture.name)
            write_file(files[-1], picture.content)
            lines.append(f"![{picture.caption}]({folder.name}/{picture.name})")
            lines.append(picture.caption)
    write_file(path, "\n\n".join(lines) + "\n")
    return files


def write_html(path: Path, title: str, sections: Sequence[Section]) -> None:
    """Write a report as one file that needs nothing beside it.

    Raises:
        InputError: the folder cannot be written.
    """
    converter = markdown.Markdown(extensions=["tables", "fenced_code", "toc"])
    converter.preprocessors.deregister("html_block")  # tags in sentences are letters
    converter.inlinePatterns.deregister("html")
    contents = "\n\n".join(f"## {section.title}\n\n" + "\n\n".join(section.parts) for section in sections)
    text = converter.convert(f"# {title}\n\n[TOC]\n\n{contents}")
    headings = re.split(r"(?=<h2)", text)
    for number, section in enumerate(sections, 1):
        headings[number] += "\n".join(map(_figure, section.pictures))
    write_file(path, _PAGE.format(title=html.escape(title), body="".join(headings)))


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>
body {{ font: 15px/1.5 sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; color: #222 }}
table {{ border-collapse: collapse; font-size: 13px; margin: 1em 0 }}
td, th {{ border-bottom: 1px solid #ddd; padding: .25em .7em; text-align: left }}
img {{ max-width: 100% }} figure {{ margin: 1em 0 }} figcaption {{ color: #666; font-size: 13px }}
pre {{ background: #f5f5f5; padding: .7em; overflow-x: auto; font-size: 12px }}
</style></head><body>
{body}
</body></html>
"""


def _figure(picture: Picture) -> str:
    kind = "png" if picture.name.endswith(".png") else "jpeg"
    data = base64.b64encode(picture.content).decode()
    caption = html.escape(picture.caption)
    image = f'<img alt="{caption}" src="data:image/{kind};base64,{data}">'
    return f"<figure>{image}<figcaption>{caption}</figcaption></figure>"
