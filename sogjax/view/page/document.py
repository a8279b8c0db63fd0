"""A page: sections of HTML in one file, with its style and script within, light or dark as the reader's system is."""

import base64
import html
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from string import Template
from typing import Any

import cv2
import numpy as np
from jaxtyping import UInt8

JPEG_QUALITY = 78

Picture = UInt8[np.ndarray, "_h _w 3"]
"""BGR."""


@dataclass(frozen=True)
class Section:
    """A heading with HTML below it."""

    title: str
    content: str
    short: str = ""
    """Its name in the contents; empty: the title."""

    @property
    def anchor(self) -> str:
        """Its place in the address of the page."""
        return re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-")


def document(title: str, subtitle: str, sections: Sequence[Section], data: Mapping[str, Any] | None = None) -> str:
    """The whole page; `data` is what its script needs to know."""
    links = "".join(f'<a href="#{each.anchor}">{text(each.short or each.title)}</a>' for each in sections)
    body = "".join(
        f'<section id="{each.anchor}"><h2>{text(each.title)}</h2>{each.content}</section>' for each in sections
    )
    known = json.dumps(data or {}, separators=(",", ":")).replace("<", "\\u003c")
    return Template(_part("page.html")).substitute(
        title=text(title),
        subtitle=text(subtitle),
        links=links,
        body=_told_apart(body),
        style=_part("page.css"),
        script=_part("page.js"),
        data=known,
    )


def _told_apart(body: str) -> str:
    """The same HTML with names in each SVG that differ from those in others."""
    parts = re.split(r"(?=<svg )|(?<=</svg>)", body)
    prefixed = lambda part, number: re.sub(r'(\sid="|href="#|url\(#)', rf"\g<1>s{number}", part)
    return "".join(prefixed(part, k) if part.startswith("<svg ") else part for k, part in enumerate(parts))


@cache
def _part(name: str) -> str:
    return files("sogjax.view.page").joinpath(name).read_text(encoding="utf-8")


def text(content: object) -> str:
    """Plain text as HTML."""
    return html.escape(str(content))


def paragraph(content: object, kind: str = "") -> str:
    """A paragraph of plain text."""
    return f"<p{_class(kind)}>{text(content)}</p>"


def bullets(items: Iterable[str]) -> str:
    """A list of HTML items; nothing where there are none."""
    lines = "".join(f"<li>{item}</li>" for item in items)
    return f"<ul>{lines}</ul>" if lines else ""


def table(head: Sequence[object], rows: Iterable[Sequence[object]], kind: str = "") -> str:
    """A table of plain text, which scrolls sideways where it is too wide; numbers stand at the right."""
    cells = lambda row: "".join(f"<td{_class('number' if _is_number(cell) else '')}>{text(cell)}</td>" for cell in row)
    heads = "".join(f'<th scope="col">{text(name)}</th>' for name in head)
    top = f"<thead><tr>{heads}</tr></thead>" if head else ""
    lines = "".join(f"<tr>{cells(row)}</tr>" for row in rows)
    return f'<div class="wide" tabindex="0"><table{_class(kind)}>{top}<tbody>{lines}</tbody></table></div>'


def commands(lines: Sequence[tuple[str, str]]) -> str:
    """Commands for a terminal, each below the words that say what it does."""
    return "".join(f'<p>{text(said)}</p><pre tabindex="0">{text(command)}</pre>' for said, command in lines)


def figure(picture: Picture, description: str, caption: str = "") -> str:
    """A picture with its description, and with a caption in HTML below it."""
    height, width = picture.shape[:2]
    below = f"<figcaption>{caption}</figcaption>" if caption else ""
    size = f'width="{width}" height="{height}"'
    return f'<figure><img {size} alt="{text(description)}" src="{data_uri(jpeg(picture))}">{below}</figure>'


def jpeg(picture: Picture, quality: int = JPEG_QUALITY) -> bytes:
    """A picture as JPEG."""
    return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def data_uri(content: bytes) -> str:
    """A JPEG as an address that holds it."""
    return f"data:image/jpeg;base64,{base64.b64encode(content).decode()}"


def _class(kind: str) -> str:
    return f' class="{kind}"' if kind else ""


def _is_number(cell: object) -> bool:
    return isinstance(cell, int | float) or re.fullmatch(r"[-+]?\d[\d.,]*( ?%)?", str(cell)) is not None
