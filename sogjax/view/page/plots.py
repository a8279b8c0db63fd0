"""Plots for a page, drawn by matplotlib as SVG within it, in colours that the page's style decides.

At the end, what is plotted of a motion: its joint angles in degrees, and how fast its ends move.

matplotlib is imported where a figure is made, since it is slow to import.
"""

import io
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int

from sogjax.errors import InputError
from sogjax.io.export.angles import angles_not_told, joint_angles
from sogjax.io.motion import Motion
from sogjax.model.body import Body
from sogjax.model.reach import told_dofs
from sogjax.view.bones import LEFT, RIGHT, side_of
from sogjax.view.page.document import text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLORS = {
    "ink": "#010203",
    "muted": "#010204",
    "line": "#010205",
    "accent": "#010206",
    "left": "#010207",
    "right": "#010208",
    "bad": "#010209",
    "good": "#01020a",
}
"""What stands in a figure for each of the style's colours."""
FONT = 11.0
"""Pixels."""
_INCH = 72.0
"""Pixels of an SVG."""


@dataclass(frozen=True)
class Curves:
    """One panel: some curves over the frames."""

    title: str
    unit: str
    curves: Mapping[str, Float[np.ndarray, "frame"]]
    """By colour of the style."""
    remark: str = ""
    """What else the title says."""


def curve_plots(frames: Int[np.ndarray, "frame"], panels: Sequence[Curves], names: Mapping[str, str]) -> str:
    """Panels side by side, as many as the page has room for; `names` are those of the colours."""
    return f'<div class="panels">{"".join(_panel(frames, panel, names) for panel in panels)}</div>'


def _panel(frames: Int[np.ndarray, "frame"], panel: Curves, names: Mapping[str, str]) -> str:
    drawn = new_figure(340.0, 150.0)
    axes = drawn.add_axes((0.125, 0.15, 0.855, 0.70))
    values = np.concatenate([*panel.curves.values()])
    for color, curve in panel.curves.items():
        axes.plot(frames, curve, color=COLORS[color], linewidth=1.3, solid_joinstyle="round")
    axes.set_title(f"{panel.title}, {panel.unit}{panel.remark}", loc="left", fontsize=FONT, color=COLORS["ink"], pad=5)
    style(axes, frames)
    axes.locator_params(axis="y", nbins=4)
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    margin = max(0.06 * (high - low), 0.02 if panel.unit == "m/s" else 1.0)
    axes.set_ylim(0.0 if panel.unit == "m/s" else low - margin, high + margin)
    of_each = "; ".join(
        f"{names.get(color, '') + ' ' if len(panel.curves) > 1 else ''}{np.nanmin(curve):.3g} to {np.nanmax(curve):.3g}"
        for color, curve in panel.curves.items()
    )
    return plot(drawn, axes, frames, f"{panel.title} over the frames, {panel.unit}{panel.remark}: {of_each}")


def new_figure(width: float, height: float) -> "Figure":
    """An empty, transparent figure of a size in pixels."""
    from matplotlib.figure import Figure

    found = Figure(figsize=(width / _INCH, height / _INCH), dpi=_INCH)
    found.patch.set_alpha(0.0)
    return found


def style(axes: "Axes", frames: Int[np.ndarray, "frame"], labels: bool = True) -> None:
    """Quiet axes over the frames of a clip."""
    axes.patch.set_alpha(0.0)
    for side, spine in axes.spines.items():
        spine.set_visible(side == "bottom")
        spine.set_color(COLORS["line"])
    axes.grid(axis="y", color=COLORS["line"], linewidth=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(length=0, labelsize=FONT - 1, labelcolor=COLORS["muted"], labelbottom=labels)
    axes.locator_params(axis="x", nbins=5, integer=True)
    axes.set_xlim(*span(frames))


def span(frames: Int[np.ndarray, "frame"]) -> tuple[float, float]:
    """The left and right end of the axis of frames, each of which is as wide as their distance."""
    half = 0.5 * float(frames[1] - frames[0]) if len(frames) > 1 else 0.5
    return float(frames[0]) - half, float(frames[-1]) + half


def plot(drawn: "Figure", axes: "Axes", frames: Int[np.ndarray, "frame"], description: str, kind: str = "") -> str:
    """A figure as HTML that can be clicked: `axes` say where its frames are."""
    box, (first, last) = axes.get_position(), span(frames)
    place = f'data-left="{box.x0:.4f}" data-right="{box.x1:.4f}" data-first="{first:g}" data-last="{last:g}"'
    return f'<div class="plot {kind}" {place}>{svg(drawn, description)}<i class="cursor"></i></div>'


def svg(drawn: "Figure", description: str) -> str:
    """A figure as an SVG element with a description."""
    from matplotlib import rc_context

    stream = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "page", "path.simplify_threshold": 0.3}):
        drawn.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    content = stream.getvalue()
    content = content[content.index("<svg") :]
    content = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->", "", content, flags=re.DOTALL)
    content = re.sub(r'\sid="(?![mpic][0-9a-f]{6,}|image)[^"]*"', "", content)  # names of groups, used by nobody
    content = re.sub(r"font: ([\d.]+)px [^;\"]*", r"font-size: \1px", content)
    for color, stand_in in COLORS.items():
        content = content.replace(stand_in, f"var(--{color})")
    label = text(description)
    head = re.search(r'viewBox="[^"]*"', content)
    assert head is not None
    tag = f'<svg role="img" aria-label="{label}" {head[0]}>'
    return re.sub(r"\n\s*", "\n", tag + content[content.index(">") + 1 :])


SIDES = {"left": "left", "right": "right", "accent": "middle"}
"""Colours of the style, and whose they are."""
_TITLES = {"arm_flex": "shoulder flexion", "arm_add": "shoulder adduction", "arm_rot": "shoulder rotation"}
_TITLES |= {"pro_sup": "forearm pronation", "elbow_flex": "elbow flexion", "wrist_dev": "wrist deviation"}
_TITLES |= {"wrist_flex": "wrist flexion", "knee_angle": "knee flexion", "ankle_angle": "ankle dorsiflexion"}
_TITLES |= {"subtalar_angle": "subtalar inversion"}
_FIRST = ("hip_", "knee_", "ankle_", "subtalar_", "arm_", "elbow_", "pro_", "wrist_", "pelvis_", "lumbar_", "neck_")


def angle_panels(motion: Motion, body: Body) -> list[Curves]:
    """Joint angles in degrees, left and right in one panel; of other bodies than people their degrees of freedom.

    What the body's blobs do not tell is marked.
    """
    try:
        found = {name: angle for name, angle in joint_angles(motion, motion.up).items() if "pelvis_t" not in name[:8]}
        tilt = joint_angles(motion, motion.up).get("pelvis_tilt")
        found |= {} if tilt is None else {"pelvis_tilt": tilt}
    except InputError:
        told = dict(zip(body.skeleton.dof_names, told_dofs(body).tolist(), strict=True))
        return _paired(_turning(motion, body), [name for name in told if not told[name]])
    place = lambda name: next((k for k, start in enumerate(_FIRST) if name.startswith(start)), len(_FIRST))
    return _paired({name: found[name] for name in sorted(found, key=place)}, angles_not_told(motion, motion.up))


def _turning(motion: Motion, body: Body) -> dict[str, Float[np.ndarray, "frame"]]:
    """The degrees of freedom that turn, in degrees."""
    columns = zip(body.skeleton.dof_names, body.skeleton.turning, motion.pose.T, strict=True)
    return {name: np.degrees(np.asarray(values, float)) for name, turns, values in columns if turns}


def _paired(angles: dict[str, Float[np.ndarray, "frame"]], untold: Collection[str]) -> list[Curves]:
    panels: dict[str, dict[str, np.ndarray]] = {}
    not_told: dict[str, list[str]] = {}
    for name, values in angles.items():
        side = side_of(name)
        color = "left" if side == LEFT else "right" if side == RIGHT else "accent"
        title = _without_side(name)
        shown = np.unwrap(np.asarray(values, float), period=360.0)
        title = _TITLES.get(title, title.replace("_", " "))
        panels.setdefault(title, {})[color] = shown
        not_told.setdefault(title, []).extend([color] if name in untold else [])
    return [
        Curves(title[:1].upper() + title[1:], "degrees", curves, _remark(not_told[title], curves))
        for title, curves in panels.items()
    ]


def _remark(untold: Sequence[str], curves: Mapping[str, Float[np.ndarray, "frame"]]) -> str:
    """Which of the curves, by their colours, the body's blobs do not tell."""
    whose = "" if len(untold) == len(curves) else f"{' and '.join(untold)}: "
    return f"; {whose}spheres hardly tell it" if untold else ""


def _without_side(name: str) -> str:
    words = [word for word in name.rpartition("/")[2].split("_") if word not in ("left", "right")]
    return "_".join(words[:-1] if len(words) > 1 and words[-1] in ("l", "r") else words) or name


def speed_panels(motion: Motion) -> list[Curves]:
    """Speeds in m/s of the root and of the last joint of each limb, left and right in one panel."""
    parents = np.asarray(motion.joint_parents, int)
    body = [int(np.flatnonzero(motion.blob_joint == motion.blob_joint[0])[0])]
    root = int(motion.blob_joint[body[0]])
    while parents[root] >= 0 and parents[root] in motion.blob_joint:
        root = int(parents[root])
    places = {"root": root}
    if motion.joint_limb is not None and motion.limb_names is not None:
        for limb, name in enumerate(motion.limb_names.tolist()):
            joints = np.flatnonzero(np.asarray(motion.joint_limb) == limb)
            if len(joints):
                places[str(name).rpartition("/")[2]] = int(joints[-1])
    panels: dict[str, dict[str, np.ndarray]] = {}
    for name, joint in places.items():
        words = [word for word in name.split() if word not in ("left", "right")]
        color = next((side for side in ("left", "right") if side in name.split()), "accent")
        title = {"root": "hips", "arm": "hands", "leg": "feet"}.get(" ".join(words), " ".join(words))
        panels.setdefault(title, {})[color] = speed(motion, joint)
    return [Curves(title[:1].upper() + title[1:], "m/s", curves) for title, curves in panels.items()]


def speed(motion: Motion, joint: int) -> Float[np.ndarray, "frame"]:
    """How fast a joint moves, metres per second."""
    places = np.asarray(motion.world_from_joint[:, joint, :3, 3], float)
    if len(places) < 2:
        return np.zeros(len(places))
    return np.linalg.norm(np.gradient(places, np.asarray(motion.time, float), axis=0), axis=1)
