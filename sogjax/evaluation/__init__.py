"""How far a motion is from the truth (Section 6)."""

from sogjax.evaluation.markers import (
    MarkerRule,
    PointErrors,
    VirtualMarkers,
    attach_markers,
    joint_errors,
    marker_errors,
)
from sogjax.evaluation.metrics import ErrorSummary, LostPoint, lost_points, summarize
from sogjax.evaluation.report import Evaluation, GroupEvaluation, evaluate_motion, evaluate_motions
from sogjax.evaluation.swaps import Swap, identity_swaps

__all__ = [
    "ErrorSummary",
    "Evaluation",
    "GroupEvaluation",
    "LostPoint",
    "MarkerRule",
    "PointErrors",
    "Swap",
    "VirtualMarkers",
    "attach_markers",
    "evaluate_motion",
    "evaluate_motions",
    "identity_swaps",
    "joint_errors",
    "lost_points",
    "marker_errors",
    "summarize",
]
