"""A report as a list of sections, written as Markdown with pictures beside it, and as one HTML file."""

import base64
import html
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from sogjax.io.files import atomic_path


@dataclass(frozen=True)
class Picture:
    """A picture of a report."""

    name: str
    """Of its file, with the ending `.png` or `.jpg`."""
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
            with atomic_path(files[-1]) as temporary:
                temporary.write_bytes(picture.content)
            lines.append(f"![{picture.caption}]({folder.name}/{picture.name})")
            lines.append(picture.caption)
    with atomic_path(path) as temporary:
        temporary.write_text("\n\n".join(lines) + "\n", encoding="utf-8")
    return files


def write_html(path: Path, title: str, sections: Sequence[Section]) -> None:
    """Write a report as one file that needs nothing beside it.

    Raises:
        InputError: the folder cannot be written.
    """
    body = [f"<h1>{html.escape(title)}</h1>", _contents(sections)]
    for number, section in enumerate(sections):
        body.append(f'<h2 id="s{number}">{html.escape(section.title)}</h2>')
        body += [_block(part) for part in section.parts]
        body += [_figure(picture) for picture in section.pictures]
    page = _PAGE.format(title=html.escape(title), body="\n".join(body))
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


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


def _contents(sections: Sequence[Section]) -> str:
    links = (f'<li><a href="#s{k}">{html.escape(section.title)}</a></li>' for k, section in enumerate(sections))
    return "<ul>" + "".join(links) + "</ul>"


def _block(part: str) -> str:
    """A paragraph, list, table or piece of code as HTML."""
    lines = part.strip().splitlines()
    if part.startswith("```"):
        return "<pre>" + html.escape("\n".join(lines[1:-1])) + "</pre>"
    if part.startswith("|"):
        return "\n".join(_table(lines))
    if part.startswith("- "):
        return "<ul>" + "".join(f"<li>{_inline(line.removeprefix('- '))}</li>" for line in lines) + "</ul>"
    return f"<p>{_inline(part)}</p>"


def _table(lines: Sequence[str]) -> Iterator[str]:
    """Rows of a table, the second of which only rules it; lines after it are paragraphs."""
    rows = [line for line in lines if line.startswith("|")]
    yield "<table>"
    for number, line in enumerate(rows):
        if number != 1:
            tag = "th" if number == 0 else "td"
            cells = (cell.strip() for cell in line.strip("|").split("|"))
            yield "<tr>" + "".join(f"<{tag}>{_inline(cell)}</{tag}>" for cell in cells) + "</tr>"
    yield "</table>"
    yield from (f"<p>{_inline(line)}</p>" for line in lines if line and not line.startswith("|"))


def _inline(text: str) -> str:
    return re.sub(r"`([^`]*)`", r"<code>\1</code>", html.escape(text))


def _figure(picture: Picture) -> str:
    kind = "png" if picture.name.endswith(".png") else "jpeg"
    data = base64.b64encode(picture.content).decode()
    caption = html.escape(picture.caption)
    image = f'<img alt="{caption}" src="data:image/{kind};base64,{data}">'
    return f"<figure>{image}<figcaption>{caption}</figcaption></figure>"
