"""Somebody who only lifts his arms, in the samples that a background is learnt from."""

from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.recording import Recording, open_recording
from sogjax.io.video import read_frames
from sogjax.model.camera import distort, project_points
from sogjax.model.rotation import axis_vector
from sogjax.scene.clip_background import SampledCamera
from sogjax.scene.coarse_views import CoarseViews
from sogjax.synth.render import render_recording
from sogjax.synth.settings import SynthSettings

FRAMES = 10
OTHER_UPS = [((1, 0, 0), (0, 0, 1), (0, -1, 0)), ((1, 0, 0), (0, -1, 0), (0, 0, -1))]
"""From the recording's world to such with another vertical."""


@dataclass
class WavingPerson:
    """What eight cameras show, and where the knees are."""

    recording: Recording
    sampled: dict[int, SampledCamera]
    knees: np.ndarray
    heads: np.ndarray

    @classmethod
    def rendered(cls, folder):
        """Render the recording and take its samples."""
        small = {"width": 216, "height": 162, "cameras": 8, "frames": FRAMES, "fps": 6.0}
        render_recording(SynthSettings(motion="arms", example_poses=False, background=False, **small), folder)
        recording, truth = open_recording(folder), load_ground_truth(folder / "ground_truth.npz")
        shown = list(read_frames(recording, 0, FRAMES))
        sampled = {
            camera: SampledCamera.from_images({k: images[camera] for k, images in enumerate(shown)})
            for camera in range(len(recording.rig.names))
        }
        knees = [truth.joints[FRAMES // 2, truth.joint_names.index(f"{side}_knee")] for side in ("left", "right")]
        ends = [truth.joints[FRAMES // 2, truth.joint_names.index(name)] for name in ("neck", "head_top")]
        return cls(
            recording, sampled, np.array(knees, np.float32), np.array([0.4 * ends[0] + 0.6 * ends[1]], np.float32)
        )

    def seen(self, cameras, turn=None):
        """What some cameras see together, in a world that is turned."""
        turn = np.eye(3) if turn is None else np.array(turn, float)
        there = np.eye(4, dtype=np.float32)
        there[:3, :3] = turn.T
        rig = {k: self.recording.rig.camera(self.recording.rig.names[k]) for k in cameras}
        rig = {
            k: eqx.tree_at(lambda c: c.camera_from_world, one, one.camera_from_world @ there) for k, one in rig.items()
        }
        movements = {k: np.any(self.sampled[k].movements, axis=0) for k in cameras}
        pictures = {k: self.sampled[k].even.reference for k in cameras}
        views = CoarseViews.of(movements, pictures, rig, turn @ axis_vector(self.recording.up))
        assert views is not None
        return views

    def shown_at(self, masks, points):
        """Whether each camera's mask holds points of the recording's world."""
        hits = []
        for k, mask in masks.items():
            camera = self.recording.rig.camera(self.recording.rig.names[k])
            pixels = np.asarray(distort(camera, project_points(camera, jnp.asarray(points))[0]))
            columns, rows = np.rint(pixels).astype(int).T
            hits.append(mask[rows, columns])
        return np.array(hits)
