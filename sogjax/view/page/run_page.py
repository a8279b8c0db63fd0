"""The page of a run, from what its passes left."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from sogjax.errors import counted
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.motion import Motion, motion_from_poses
from sogjax.model.body import Body
from sogjax.model.cores import in_threads
from sogjax.model.rotation import world_from_upright
from sogjax.quality.limb_warnings import in_doubt
from sogjax.quality.remedies import remedies
from sogjax.quality.verdict import Verdict
from sogjax.view.page.document import (
    Section,
    bullets,
    commands,
    data_uri,
    document,
    figure,
    jpeg,
    paragraph,
    table,
    text,
)
from sogjax.view.page.pictures import FramePictures, Picture, SkeletonPictures, cuts, silhouette_pictures
from sogjax.view.page.plots import SIDES, angle_panels, curve_plots, speed_panels
from sogjax.view.page.sight import hidden_limbs
from sogjax.view.page.timeline import Marks, timeline
from sogjax.view.sheets import body_picture

QUALITY, MOST_BYTES = 72, 9_500_000
"""JPEG quality of the pictures of frames, and bytes of the whole page, at most."""


@dataclass(frozen=True)
class ActorOnPage:
    """What the page shows of one actor."""

    motion: Motion
    body: Body
    verdict: Verdict
    revised: Bool[np.ndarray, "frame limb"] | None
    """Taken from another pass; None: that is not known."""
    errors: Sequence[Sequence[object]] = ()
    """Rows of a table: point, mean and deviation in mm; none where there is no truth."""


@dataclass(frozen=True)
class RunOnPage:
    """What the page shows of a run."""

    title: str
    subtitle: str
    rig: CameraRig
    """All cameras."""
    actors: Sequence[ActorOnPage]
    cameras: Sequence[int]
    """Whose pictures are shown."""
    pictures: Iterable[FramePictures]
    """Frames in the order of time, at most `width` pixels wide."""
    width: int
    worst: Mapping[int, Picture]
    """Close-ups of the frames that fit worst."""
    numbers: Sequence[Sequence[object]] = ()
    """What else is known, in rows."""
    notes: Sequence[str] = ()
    """Warnings, and what was changed."""
    settings: Sequence[Sequence[object]] = ()
    """Settings that differ: key, value, default."""
    versions: Sequence[Sequence[object]] = ()
    files: Sequence[Sequence[object]] = ()
    """Files and what they hold."""
    commands: Sequence[tuple[str, str]] = field(default=())
    """What may come next: words and a command."""
    links: Mapping[str, str] = field(default_factory=dict)
    """Other pages: words and address."""


def run_page(run: RunOnPage) -> str:
    """The page as HTML."""
    motions = [actor.motion for actor in run.actors]
    shown = cuts(run.rig, motions, run.cameras)
    pictures = list(run.pictures)
    drawn = _drawn(run, motions, shown, pictures)
    after = [
        Section("The frames that fit worst", _worst(run), "Worst frames"),
        Section("Joint angles", _curves(run, angles=True)),
        Section("Speeds", _curves(run, angles=False)),
        Section(
            "The actor" if len(run.actors) == 1 else "The actors", _silhouettes(run, motions, shown, pictures), "Actor"
        ),
        Section("Numbers", _numbers(run)),
        Section("Next steps", _steps(run)),
        Section("Settings and versions", _settings(run), "Settings"),
    ]
    drawn = _fitting(drawn, MOST_BYTES - sum(len(each.content) for each in after))
    before = [
        Section("Verdict", "".join(_verdict(actor, len(run.actors) > 1) for actor in run.actors)),
        Section("Pictures and confidence", _viewer(run, drawn), "Pictures"),
    ]
    sections = [each for each in (*before, *after) if each.content]
    return document(run.title, run.subtitle, sections, _data(run, drawn))


def _fitting(drawn: list[tuple[int, str]], most: int) -> list[tuple[int, str]]:
    """Every n-th picture, so that they take so many bytes at most."""
    while len(drawn) > 2 and sum(len(content) for _, content in drawn) > most:
        drawn = drawn[::2]
    return drawn


def _drawn(
    run: RunOnPage, motions: Sequence[Motion], shown: Sequence[Any], pictures: Sequence[FramePictures]
) -> list[tuple[int, str]]:
    """Frames with skeletons, as addresses of JPEGs."""
    if not pictures:
        return []
    numbers = [frame for frame, _ in pictures]
    drawing = SkeletonPictures(
        run.rig, [motion.of_rows(np.isin(motion.frame, numbers)) for motion in motions], shown, run.width
    )
    contents = in_threads(lambda each: data_uri(jpeg(drawing.draw(*each), QUALITY)), pictures)
    return list(zip(numbers, contents, strict=True))


def _silhouettes(
    run: RunOnPage, motions: Sequence[Motion], shown: Sequence[Any], pictures: Sequence[FramePictures]
) -> str:
    """The bodies at rest, and their outlines over pictures of two frames."""
    chosen = [pictures[k] for k in sorted({len(pictures) // 4, (3 * len(pictures)) // 4})] if pictures else []
    parts = []
    for frame, picture in silhouette_pictures(run.rig, motions, shown, chosen):
        words = f"Silhouettes in {_link(frame)}: each body's outline should follow that of the person."
        parts.append(figure(picture, f"The outline of the actors' bodies over the pictures of frame {frame}", words))
    for actor in run.actors:
        means, colors = _at_rest(actor), np.asarray(actor.body.blob_colors, float)
        name, sigmas = actor.verdict.actor, np.asarray(actor.body.blob_sigmas, float)
        words = f"{text(name)}: {counted(len(sigmas), 'blob')} at rest, from the front and from the left."
        parts.append(figure(body_picture(means, sigmas, colors), f"The blobs of {name} in their colours", words))
    links = bullets(f'<a href="{text(address)}">{text(words)}</a>' for words, address in run.links.items())
    return f'<div class="two">{"".join(parts)}</div>{links}'


def _at_rest(actor: ActorOnPage) -> Float[np.ndarray, "blob 3"]:
    """The blobs of the body at rest, metres, x forward and z up."""
    rest = np.asarray(actor.body.poses["rest"])[None]
    return motion_from_poses(actor.body, rest, 1.0).blob_means[0].astype(float) @ world_from_upright(actor.motion.up)


def _verdict(actor: ActorOnPage, several: bool) -> str:
    verdict = actor.verdict
    kind, mark, said = ("wrong", "✕", "Cannot be relied on") if verdict.wrong else ("look", "!", "Look at it")
    if verdict.looks_right:
        kind, mark, said = "right", "✓", verdict.sentence[:1].upper() + verdict.sentence[1:]
    title = f"{verdict.actor}: {said}" if several else said
    found = bullets(_linked(each) for each in verdict.findings) + _all_doubtful(verdict)
    what = bullets(text(each) for each in remedies(verdict))
    facts = _facts(actor)
    return (
        f'<div class="card verdict {kind}"><h3><span class="mark" aria-hidden="true">{mark}</span>{text(title)}</h3>'
        f"{found}{facts}<h4 class='note' style='margin:0'>What to do</h4>{what}</div>"
    )


def _all_doubtful(verdict: Verdict) -> str:
    """All stretches of limbs in doubt, where the findings name only some."""
    if not any(each.startswith("and ") for each in verdict.findings) or not verdict.doubtful:
        return ""
    lines = bullets(
        f"{_linked(f'frames {limb.first_frame}-{limb.last_frame}')}: {text(limb.name)}, {1.0 - limb.doubt:.0%} sure"
        for limb in verdict.doubtful
    )
    summary = f"All {counted(len(verdict.doubtful), 'doubtful stretch', 'doubtful stretches')}"
    return f"<details><summary>{summary}</summary>{lines}</details>"


def _facts(actor: ActorOnPage) -> str:
    """The numbers that the verdict rests on."""
    verdict, motion = actor.verdict, actor.motion
    facts = []
    if verdict.explained is not None:
        among = "" if verdict.expected is None else f" of {verdict.expected:.0%}"
        facts.append(("explained" + (", of its examples'" if among else ""), f"{verdict.explained:.0%}{among}"))
    if verdict.overlap:
        facts.append(("silhouettes overlap", f"{np.median(list(verdict.overlap.values())):.0%}"))
    if motion.limb_doubt is not None and motion.limb_doubt.size:
        facts.append(("limbs sure", f"{1.0 - np.mean(in_doubt(motion)):.1%}"))
    if actor.revised is not None:
        facts.append(("frames revised", f"{np.mean(actor.revised.any(axis=1)):.1%}"))
    cells = "".join(f"<div><dt>{text(name)}</dt><dd>{text(value)}</dd></div>" for name, value in facts)
    return f'<dl class="facts">{cells}</dl>' if cells else ""


def _viewer(run: RunOnPage, drawn: Sequence[tuple[int, str]]) -> str:
    motions = [actor.motion for actor in run.actors]
    hidden = hidden_limbs(run.rig, motions)
    timelines = []
    for actor, not_seen in zip(run.actors, hidden, strict=True):
        head = f"<h3>{text(actor.verdict.actor)}</h3>" if len(run.actors) > 1 else ""
        timelines.append(
            head
            + timeline(
                actor.motion,
                Marks(not_seen, actor.revised if actor.revised is not None else np.zeros_like(not_seen)),
                actor.verdict.expected,
            )
        )
    named = {"sure": "sure", "half": "doubtful", "lost": "likely lost"}
    named |= {
        "hidden": "hidden: seen by fewer than two cameras, or behind things",
        "revised": "revised: taken from another pass",
    }
    key = "".join(f'<li><i class="{kind}"></i>{words}</li>' for kind, words in named.items())
    key = f'<ul class="key">{key}</ul>' if any(each.size for each in hidden) else ""
    right = f"<div>{''.join(timelines)}{key}</div>"
    if not drawn:
        return f'<div class="card">{right}</div>'
    frames = motions[0].frame
    step = int(frames[1] - frames[0]) if len(frames) > 1 else 1
    first = drawn[0]
    screen = (
        f'<div class="screen"><img id="screen" alt="The cameras\' pictures of frame {first[0]} with the skeleton over '
        f'them" src="{first[1]}"><div class="player"><button id="before" aria-label="picture before">&lt;'
        '</button><button id="play">Play</button><button id="after" aria-label="next picture">&gt;</button>'
        f'<input type="range" id="frame" aria-label="frame" min="{frames[0]}" max="{frames[-1]}" step="{step}" '
        f'value="{first[0]}"></div><output id="said" for="frame"></output></div>'
    )
    whose = f" of {run.actors[0].verdict.actor}, others have other colours"
    hint = paragraph(
        "Click in a timeline or a curve, or move the slider (arrow keys work): the pictures follow. Dashed bones "
        f"belong to a limb in doubt; blue is left, red is right{'' if len(run.actors) == 1 else whose}.",
        "note",
    )
    return f'{hint}<div class="card viewer">{screen}{right}</div>'


def _worst(run: RunOnPage) -> str:
    parts = []
    for frame, picture in run.worst.items():
        said = [why for actor in run.actors if (why := _why(actor, frame, len(run.actors) > 1))]
        described = f"Close-up of frame {frame} with the skeleton" + (f": {'; '.join(said)}" if said else "")
        parts.append(figure(picture, described, f"{_link(frame)}{': ' if said else ''}{text('; '.join(said))}"))
    return f'<div class="two">{"".join(parts)}</div>' if parts else ""


def _why(actor: ActorOnPage, frame: int, several: bool) -> str:
    """What is low in a frame."""
    motion = actor.motion
    rows = np.flatnonzero(motion.frame == frame)
    if not len(rows) or motion.limb_doubt is None or motion.limb_names is None:
        return ""
    limbs = zip(motion.limb_names.tolist(), motion.limb_doubt[rows[0]], in_doubt(motion)[rows[0]], strict=True)
    low = [f"{name.rpartition('/')[2]} {1.0 - doubt:.0%} sure" for name, doubt, doubted in limbs if doubted]
    parts = low or ["all limbs sure"]
    if motion.explained is not None:
        parts.append(f"{motion.explained[rows[0]]:.0%} explained")
    return f"{actor.verdict.actor + ': ' if several else ''}{', '.join(parts)}"


def _curves(run: RunOnPage, angles: bool) -> str:
    found = []
    for actor in run.actors:
        panels = angle_panels(actor.motion, actor.body) if angles else speed_panels(actor.motion)
        head = f"<h3>{text(actor.verdict.actor)}</h3>" if len(run.actors) > 1 else ""
        if panels:
            found.append(head + f'<div class="card">{curve_plots(actor.motion.frame, panels, SIDES)}</div>')
    key = '<ul class="key"><li><i class="left"></i>left</li><li><i class="right"></i>right</li></ul>'
    return key + "".join(found) if found else ""


def _numbers(run: RunOnPage) -> str:
    parts = [f"<div>{table((), run.numbers, 'plain')}</div>"]
    for actor in run.actors:
        if actor.errors:
            whose = f" of {actor.verdict.actor}" if len(run.actors) > 1 else ""
            head, (whole, *points) = ("point", "mean", "deviation"), actor.errors
            every = f"<details><summary>Every point</summary>{table(head, points)}</details>" if points else ""
            errors = table(head, [whole]) + every
            parts.append(f"<div><h3>Errors{text(whose)} against the truth, mm</h3>{errors}</div>")
    return f'{bullets(text(note) for note in run.notes)}<div class="two">{"".join(parts)}</div>'


def _steps(run: RunOnPage) -> str:
    held = f"<h3>Files beside this page</h3>{table(('file', 'holds'), run.files)}" if run.files else ""
    return commands(run.commands) + held


def _settings(run: RunOnPage) -> str:
    same = paragraph("All settings are the defaults.")
    found = table(("setting", "here", "default"), run.settings, "plain") if run.settings else same
    versions = ", ".join(f"{name} {number}" for name, number in run.versions)
    return f"{found}<h3>Versions</h3>{paragraph(versions)}"


def _data(run: RunOnPage, drawn: Sequence[tuple[int, str]]) -> dict[str, Any]:
    """What the script needs: pictures, and what is said of every frame."""
    motion = run.actors[0].motion
    return {
        "fps": motion.fps,
        "frames": motion.frame.tolist(),
        "pictures": [*drawn],
        "actors": [_of_actor(actor) for actor in run.actors],
    }


def _of_actor(actor: ActorOnPage) -> dict[str, Any]:
    motion, percent = actor.motion, lambda values: np.rint(100.0 * np.asarray(values, float)).astype(int).tolist()
    judged = motion.limb_doubt is not None and motion.limb_names is not None
    return {
        "name": actor.verdict.actor,
        "explained": None if motion.explained is None else percent(motion.explained),
        "limbs": [name.rpartition("/")[2] for name in motion.limb_names.tolist()] if judged else [],  # pyright: ignore[reportOptionalMemberAccess]
        "sure": percent(1.0 - motion.limb_doubt.T) if judged else [],  # pyright: ignore[reportOptionalMemberAccess]
        "doubted": in_doubt(motion).T.astype(int).tolist() if judged else [],
    }


def _link(frame: int) -> str:
    return f'<a href="#frame={frame}">frame {frame}</a>'


def _linked(sentence: str) -> str:
    """A sentence whose frames are links."""
    return re.sub(r"(frames? )(\d+)(-\d+)?", r'<a href="#frame=\2">\1\2\3</a>', text(sentence))
