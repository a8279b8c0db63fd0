"""The page of a check: what was found of a recording, worst first, and the calibration drawn into its pictures."""

from collections.abc import Mapping, Sequence

from sogjax.check.findings import Finding
from sogjax.errors import counted
from sogjax.view.page.document import Picture, Section, document, figure, paragraph, table, text

_KINDS = {"error": ("wrong", "✕"), "warning": ("look", "!"), "note": ("note-card", "i"), "ok": ("right", "✓")}


def check_page(
    name: str, subtitle: str, findings: Sequence[Finding], room: Picture, offsets: Mapping[str, float], line: str
) -> str:
    """The page as HTML.

    Args:
        name: of the recording.
        subtitle: what was looked at.
        findings: the worst first.
        room: the calibration drawn into the pictures.
        offsets: time offsets that were found, by camera; none where none was.
        line: what `recording.yaml` should say of them.
    """
    told = [each for each in findings if each.severity != "ok"]
    fine = [each for each in findings if each.severity == "ok"]
    described = f"The pictures of all cameras of {name} with the calibrated floor, axes and other cameras drawn in"
    legend = "Where the drawn floor is not on the floor, or cameras are drawn elsewhere than they are, nothing fits."
    sections = [
        Section("What was found", _summary(findings) + "".join(map(_card, told)), "Findings"),
        Section("The calibration in the pictures", figure(room, described, text(legend)), "Pictures"),
        Section("What is right", table((), [(each.topic, each.what) for each in fine]) if fine else ""),
        Section("Time offsets", _offsets(offsets, line) if offsets else ""),
    ]
    return document(name, subtitle, [each for each in sections if each.content])


def _summary(findings: Sequence[Finding]) -> str:
    counts = {kind: sum(each.severity == kind for each in findings) for kind in _KINDS}
    parts = [counted(count, kind) for kind, count in counts.items() if count and kind != "ok"]
    parts += [f"{counts['ok']} checked and right"] if counts["ok"] else []
    wrong = " Nothing right can be made of the recording before the errors are mended." if counts["error"] else ""
    return paragraph(f"{', '.join(parts)}.{wrong}")


def _card(finding: Finding) -> str:
    kind, mark = _KINDS[finding.severity]
    lines = [f"<p>{text(finding.what)}</p>"]
    lines += [f"<p><b>Likely cause:</b> {text(finding.cause)}</p>"] if finding.cause else []
    lines += [f"<p><b>What to do:</b> {text(finding.remedy)}</p>"] if finding.remedy else []
    head = f'<h3><span class="mark" aria-hidden="true">{mark}</span>{text(f"{finding.severity}: {finding.topic}")}</h3>'
    return f'<div class="card verdict {kind}">{head}{"".join(lines)}</div>'


def _offsets(offsets: Mapping[str, float], line: str) -> str:
    rows = [(name, f"{offset:g}") for name, offset in offsets.items()]
    said = paragraph("The line for recording.yaml; sogjax check ... write=true writes it:")
    return f'{table(("camera", "frames"), rows)}{said}<pre tabindex="0">{text(line)}</pre>'
