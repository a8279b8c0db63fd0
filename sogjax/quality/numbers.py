"""The numbers of an evaluation as mappings and as rows of a plain-text table, in millimetres."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from sogjax.quality.markers import PointErrors
from sogjax.quality.metrics import ErrorSummary, mean_per_frame, mean_per_point, std_per_point, summarize

MM = 1000.0
TABLE_ROW = "{:<24}{:>8}{:>8}{:>8}{:>8}{:>8}{:>7}{:>7}"


def summary_dict(summary: ErrorSummary) -> dict[str, Any]:
    """A summary for JSON, in millimetres."""
    return in_mm(asdict(summary), "mean", "std", "median", "percentile_95", "maximum")


def rule_dict(parts: Sequence[PointErrors]) -> dict[str, float]:
    """Mean and deviation of all markers of some actors, for JSON."""
    summary = summarize(np.concatenate([part.errors.reshape(-1, 1) for part in parts]))
    return {"mean_mm": MM * summary.mean, "std_mm": MM * summary.std}


def summary_row(title: str, s: ErrorSummary) -> str:
    """One line of the table."""
    if s.num_values == 0:
        return TABLE_ROW.format(title, *"-------")
    lengths = [f"{MM * value:.1f}" for value in (s.mean, s.std, s.median, s.percentile_95, s.maximum)]
    return TABLE_ROW.format(title, *lengths, f"{s.under_50mm:.0%}", f"{s.under_100mm:.0%}")


def points_dict(points: PointErrors | None) -> dict[str, Any] | None:
    """Points for JSON: all together, each one, each frame."""
    if points is None:
        return None
    per_point = zip(
        points.names,
        points.compared_with,
        mean_per_point(points.errors),
        std_per_point(points.errors),
        strict=True,
    )
    return {
        **summary_dict(summarize(points.errors)),
        "per_point": {
            name: {"joint": joint, "mean_mm": MM * float(mean), "std_mm": MM * float(std)}
            for name, joint, mean, std in per_point
        },
        "mean_per_frame_mm": [MM * float(value) for value in mean_per_frame(points.errors)],
    }


def in_mm(content: dict[str, Any], *keys: str) -> dict[str, Any]:
    """A mapping with some lengths in millimetres, which their keys then say."""
    return {f"{k}_mm" if k in keys else k: MM * v if k in keys else v for k, v in content.items()}
