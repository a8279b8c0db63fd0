"""What a check of a recording reports: one finding for each thing that was checked or noticed."""

from collections.abc import Iterable
from dataclasses import dataclass

SEVERITIES = ("ok", "note", "warning", "error")
"""From harmless to fatal: `ok` was checked and is right, `error` keeps a recording from being opened,
or anything right from being made of it."""


@dataclass(frozen=True)
class Finding:
    """One thing that was noticed, in one or two sentences."""

    severity: str
    """One of `SEVERITIES`."""
    topic: str
    """What was checked: files, cameras, unit, vertical, calibration, frames, synchronisation, exposure,
    keypoints."""
    what: str
    cause: str = ""
    """The likely one; empty where nothing is wrong."""
    remedy: str = ""
    cameras: tuple[str, ...] = ()
    """The cameras it concerns; empty for the whole recording."""

    def sentence(self) -> str:
        """The finding in one or two sentences."""
        parts = [self.what]
        if self.cause:
            parts.append(f"likely cause: {self.cause}")
        if self.remedy:
            parts.append(f"remedy: {self.remedy}")
        return "; ".join(parts)

    def line(self) -> str:
        """The finding as a line for a terminal."""
        return f"{self.severity:<8} {self.topic:<16} {self.sentence()}"


def worst_first(findings: Iterable[Finding]) -> list[Finding]:
    """The findings by severity, those of equal severity in their order."""
    return sorted(findings, key=lambda finding: -SEVERITIES.index(finding.severity))
