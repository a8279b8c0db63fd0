"""Skeletons of other programs and a motion, text for text."""

JOINTS = [
    ("elbow", "revolute", "shoulder", (310.0, 0.0, 0.0), (0.0, 0.0, 2.0), 1.1),
    ("tx", "prismatic", "none", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0),
    ("ty", "prismatic", "tx", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1.0),
    ("turn", "revolute", "ty", (0.0, 50.0, 0.0), (0.0, 1.0, 0.0), 1.0),
    ("shoulder", "revolute", "turn", (180.0, 420.0, -10.0), (1.0, 1.0, 0.0), 0.9),
    ("hand", "prismatic", "elbow", (250.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0),
]
"""The first one's parent comes later in the file."""

MARKERS = ["marker_a turn point 10 20 30", "belly turn point 0 100 0 120", "fist hand point 40 0 0 54 255 127.5 0"]

DOFS = {"x": ("nolimits", {"tx": 1.0}), "y": ("limits -900 900", {"ty": 1.0}), "heading": ("nolimits", {"turn": 1.0}),
        "reach": ("limits -1.5 0.5", {"shoulder": 1.0, "elbow": -0.5, "hand": 20.0})}  # fmt: skip
"""The last one turns two joints and slides a third: 20 mm a radian."""


def skeleton_text(markers=MARKERS):
    lines = ["Skeletool Skeleton Definition V1.0", f"joints: {len(JOINTS)}"]
    for name, kind, parent, offset, axis, scale in JOINTS:
        lines.append(" ".join(map(str, (name, kind, parent, *offset, *axis, scale))))
    lines += [f"markers: {len(markers)}", *markers, "scaling joints: 1", "arm 2", "elbow", "hand"]
    lines.append(f"dofs: {len(DOFS)}")
    for name, (limits, weights) in DOFS.items():
        lines += [f"{name} {len(weights)}", f"  {limits}", *(f"  {joint} {w}" for joint, w in weights.items())]
    return "\r\n".join(lines) + "\r\n"


DOF_TEXT = """Skeletool DOF file v0.3
dofs: 2
bend 0.5 limits -1 1
slide 1 nolimits
joints: 3
shoulder = 0 + 0.5 bend
elbow = 0 + 1 bend + 0.001 slide
ty = 0 + 2 slide
"""


BVH = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Zrotation Xrotation Yrotation Xposition Yposition Zposition
  JOINT Spine
  {
    OFFSET 0 20 1.5
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT LeftArm
    {
      OFFSET 18 25 0
      CHANNELS 3 Yrotation Zrotation Xrotation
      End Site
      {
        OFFSET 30 0 0
      }
    }
    JOINT RightArm
    {
      OFFSET -18 25 0
      CHANNELS 3 Yrotation Zrotation Xrotation
      End Site
      {
        OFFSET -30 0 0
      }
    }
  }
  JOINT LeftLeg
  {
    OFFSET 9 -4 0
    CHANNELS 1 Xrotation
    End Site
    {
      OFFSET 0 -80 2
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.04
5 -10 40 12 90 -7 11 22 -33 44 -55 66 -7 8 9 35
-15 20 170 -3 88 4 1 2 3 -80 70 60 50 40 30 -20
"""

MOTION = "Skeletool Motion File V1.0\n0 1 2 3 4\n1 5 6 7 8.5\n4 -1 -2e-3 0 1\n"
