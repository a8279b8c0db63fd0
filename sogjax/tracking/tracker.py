"""Tracking (Section 5.3): predict, cull, solve, advance; the same compiled step for every frame of a recording."""

from dataclasses import replace
from functools import partial
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from sogjax.energy.coloring import Coloring
from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.hidden import without_hidden
from sogjax.energy.keypoint_views import KeypointViews
from sogjax.energy.keypoints import keypoint_term_among
from sogjax.energy.posed import History, Posed
from sogjax.energy.term import Terms
from sogjax.energy.views import Views, Windows
from sogjax.model.body import Body
from sogjax.model.camera import Camera, point_depths
from sogjax.model.color import from_rgb
from sogjax.model.compiled import stage_barrier
from sogjax.model.sog import Sog
from sogjax.model.solid import Solid
from sogjax.quality.limb_confidence import LimbConfidence, frame_fit, limb_confidence
from sogjax.quality.limb_evidence import LimbBlobs, blob_evidence
from sogjax.solve.solution import Scales, Solution, Solver, bounded
from sogjax.tracking.culling import Capacities, ImageReader, body_boxes, union_boxes
from sogjax.tracking.frame import AnyFrame, FrameInput, FrameResult, TrackState, on_device
from sogjax.tracking.keypoint_prefit import KeypointPrefit
from sogjax.tracking.solving import solve_near

NO_ROOM = "a frame has more image blobs than the tracker has room for; make a new one, beginning with this frame"

PairChoice = Literal["dense", "sparse"]


class Tracker(eqx.Module):
    """Everything that stays the same while a recording is tracked; several actors are one body (`concatenate`)."""

    body: Body
    cameras: Camera
    normalizers: Float[Array, "camera"]
    reader: ImageReader
    terms: Terms
    """Of the energy; what is added to the standard ones is climbed by every solver."""
    solver: Solver
    scales: Scales
    extrapolation: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    """alpha of Section 5.3."""
    pairs: PairChoice = eqx.field(static=True, default="dense")
    """Whether all pairs of blobs are compared, or those near each other."""
    limbs: LimbBlobs | None = None
    """Which are judged in every frame; None: none."""
    solid: Solid | None = None
    """What cannot be in one place, which searches ask; None: anything may be anywhere."""
    capacities: Capacities | None = None
    """Room for image blobs of a step that is given none."""
    initial_pose: Float[Array, "dof"] | None = None
    """Where `start` begins."""

    def start(self, pose: Float[Array | np.ndarray, "dof"] | None = None) -> TrackState:
        """The state before the first frame, from a rough pose of it; None: from `initial_pose`.

        Raises:
            ValueError: there is neither.
        """
        pose = self.initial_pose if pose is None else pose
        if pose is None:
            raise ValueError("the tracker knows no initial pose; give one: tracker.start(pose)")
        return self.with_memory(TrackState.from_pose(jnp.asarray(pose, self.body.skeleton.offsets.dtype)))

    def with_memory(self, state: TrackState) -> TrackState:
        """The state with all that a step hands on to the next one, so that every step takes the same."""
        if self.limbs is None or self.reader.subject is None or state.baseline is not None:
            return state
        return replace(state, baseline=jnp.full((2, self.body.num_blobs), jnp.nan, self.body.blob_sigmas.dtype))

    def predicted(self, state: TrackState) -> Float[Array, "dof"]:
        """Theta_0 of Section 5.3: linear extrapolation of the last two poses, unless a pose is expected."""
        if state.expected is not None:
            return state.expected
        return state.previous + self.extrapolation * (state.previous - state.before_previous)

    def boxes(self, state: TrackState) -> Float[Array, "camera actor 2 2"]:
        """Where the actors may be seen."""
        return self.boxes_around(*self.box_poses(state))

    def boxes_around(self, pose: Float[Array, "dof"], other: Float[Array, "dof"]) -> Float[Array, "camera actor 2 2"]:
        """Where the actors may be seen in either pose."""
        around = lambda pose: jax.vmap(body_boxes, in_axes=(None, 0, None, None))(
            self.body.posed_blobs(pose), self.cameras, self.body.blob_actors, self.reader.box_enlargement
        )
        return union_boxes(around(pose), around(other))

    def box_poses(self, state: TrackState) -> tuple[Float[Array, "dof"], Float[Array, "dof"]]:
        """The poses around which the actors may be seen: the last and, unless told otherwise, the predicted one."""
        return state.previous, self.predicted(state) if self.reader.box_around == "predicted" else state.previous

    def rgb(self, frame: FrameInput) -> Float[Array, "camera rows columns 3"]:
        """The colours of a frame's cells (sRGB, 0 to 1)."""
        return jnp.asarray(frame.cells).astype(self.cameras.intrinsics.dtype) / 255.0

    def windows(self, frame: FrameInput, state: TrackState) -> Windows | None:
        """The log odds of foreground around the actors; None where no background is known."""
        odds = self.reader.odds(self.rgb(frame))
        if odds is None:
            return None
        windows = self._windows(odds, self.boxes(state), self.body.posed_blobs(state.previous))
        return windows if frame.present is None else windows.of_present(jnp.asarray(frame.present))

    def _windows(
        self, odds: Float[Array, "camera rows columns"], boxes: Float[Array, "camera actor 2 2"], blobs: Sog
    ) -> Windows:
        """The log odds in boxes, 0 where blobs of a pose like the one sought are hidden."""
        found, occluders = self.reader.windows(odds, self.cameras, boxes), self.reader.occluders
        if occluders is None:
            return found
        actors = tuple(self.body.blob_actors.tolist())
        return without_hidden(found, occluders.cells, self.reader.cell_sizes, self.cameras, blobs, actors)

    def views(
        self,
        frame: FrameInput,
        state: TrackState,
        capacities: Capacities,
        boxes: Float[Array, "camera actor 2 2"] | None = None,
    ) -> tuple[Views, Int[Array, "camera"], Int[Array, "camera"]]:
        """What the cameras see in boxes (None: those of the state), and the counts to hold against the capacities.

        A camera that is not present sees nothing, and the similarity is the mean over the others.
        """
        present = None if frame.present is None else jnp.asarray(frame.present)
        rgb = self.rgb(frame)
        odds, boxes = self.reader.odds(rgb), self.boxes(state) if boxes is None else boxes
        near_blobs = partial(self.reader.near_blobs, capacity=capacities.near)
        near, weights, num_near = stage_barrier(self.reader.true_at_run_time, near_blobs, rgb, odds, boxes)
        blobs = self.body.posed_blobs(state.previous)
        windows = None if odds is None else self._windows(odds, boxes, blobs)
        normalizers = self.normalizers
        if present is not None:
            near = eqx.tree_at(lambda sog: sog.mask, near, near.mask & present[:, None])
            num_near = jnp.where(present, num_near, 0)
            normalizers = normalizers * jnp.mean(present, dtype=normalizers.dtype)
            windows = None if windows is None else windows.of_present(present)
        body_colors = from_rgb(self.body.blob_colors, self.reader.color_space)
        body = eqx.tree_at(lambda sog: sog.colors, blobs, body_colors)
        depths = None
        if self.reader.occluders is not None:
            depths = jax.vmap(point_depths, in_axes=(0, None))(self.cameras, blobs.means)
        if self.pairs == "sparse":
            images, similarities, num_matching = self.reader.compared_blobs(near, weights, body, depths)
            counting = weights.foreground
        else:
            images, similarities, counting, num_matching = self.reader.matching_blobs(
                near, weights, body, depths, capacities.matching
            )
        hidden_from = weights.hidden_from if self.pairs == "sparse" else None
        coloring = Coloring(
            self.reader.color_radius, self.reader.color_space, counting, body_colors, depths, hidden_from
        )
        keypoints = self.keypoint_views(frame, state.previous, normalizers)
        views = Views(
            self.cameras, images, similarities, normalizers, coloring=coloring, windows=windows, keypoints=keypoints
        )
        return views, num_near, num_matching

    def keypoint_views(
        self, frame: FrameInput, pose: Float[Array, "dof"], normalizers: Float[Array, "camera"]
    ) -> KeypointViews | None:
        """Keypoints as the energy takes them, near a pose; None: there are none, or none of its terms looks at them."""
        pull = keypoint_term_among(self.terms)
        if pull is None or frame.keypoints is None:
            return None
        return pull.views(frame.keypoints, self.cameras, Posed.from_pose(self.body, pose), normalizers)

    def step(
        self,
        state: TrackState,
        frame: AnyFrame,
        capacities: Capacities | None = None,
    ) -> tuple[TrackState, FrameResult]:
        """Find the pose of one frame from its cells (sRGB bytes), or from all that is known of it.

        With `capacities`, whether these sufficed is for the caller to see in the counts. Without, the tracker's own
        are used, and a frame that needs more is an error when it is computed.

        Raises:
            ValueError: there are none.
        """
        frame = on_device(frame)
        if capacities is not None:
            state = self.led(state, frame)
            return self.step_in(state, frame, self.views(frame, state, capacities), capacities)
        if self.capacities is None:
            raise ValueError("the tracker has no capacities; give some, or take one of sogjax.make_tracker")
        state, result = self.step(state, frame, self.capacities)
        room = self.capacities
        cut_off = jnp.any(result.num_near > room.near) | jnp.any(result.num_matching > room.matching)
        cut_off |= result.num_blocks > room.blocks
        return eqx.error_if((state, result), cut_off, NO_ROOM)

    def step_in(
        self,
        state: TrackState,
        frame: FrameInput,
        seen: tuple[Views, Int[Array, "camera"], Int[Array, "camera"]],
        capacities: Capacities,
    ) -> tuple[TrackState, FrameResult]:
        """The rest of a step, from what `views` sees of the frame."""
        return self._judged(*self.found(state, seen, capacities), seen[0], frame)

    def led(self, state: TrackState, frame: FrameInput) -> TrackState:
        """The state, expecting the pose to which keypoints lead; the same where there are none."""
        pull = keypoint_term_among(self.terms)
        views = self.keypoint_views(frame, state.previous, self.normalizers)
        if pull is None or views is None:
            return state
        guide = KeypointPrefit(self.body, self.cameras, views, pull)
        return replace(state, expected=guide.followed(self.predicted(state), self.scales))

    def found(
        self,
        state: TrackState,
        seen: tuple[Views, Int[Array, "camera"], Int[Array, "camera"]],
        capacities: Capacities,
    ) -> tuple[TrackState, FrameResult]:
        """Find the pose of one frame from what the cameras see of it."""
        views, num_near, num_matching = seen
        history = History(state.previous, state.before_previous, state.num_known == 2)
        objective = FrameEnergy(self.body, views, history, self.terms)
        solution, num_blocks = self.solved(objective, self.predicted(state), capacities)
        result = FrameResult(
            pose=solution.params,
            energy=solution.value,
            terms=objective.values_given(solution.params, solution.value),
            iterations=solution.iterations,
            evaluations=solution.evaluations,
            converged=solution.converged,
            num_near=num_near,
            num_matching=num_matching,
            num_blocks=num_blocks,
            limbs=None,
            images=views.images,
        )
        return state.advanced(solution.params), result

    def _judged(
        self,
        state: TrackState,
        result: FrameResult,
        views: Views,
        frame: FrameInput,
    ) -> tuple[TrackState, FrameResult]:
        """The same with what the cameras say of the limbs, if they are to be judged."""
        if self.limbs is None or self.reader.subject is None:
            return state, result
        baseline = self.with_memory(state).baseline
        assert baseline is not None
        found = self.judged(result.pose, baseline, views.windows, frame)
        return replace(state, baseline=found.baseline), replace(result, limbs=found)

    def judged(
        self,
        pose: Float[Array, "dof"],
        baseline: Float[Array, "2 blob"],
        windows: Windows | None,
        frame: FrameInput,
    ) -> LimbConfidence:
        """What the cameras say of a pose and its limbs."""
        assert self.limbs is not None
        assert self.reader.subject is not None
        posed, sizes = Posed.from_pose(self.body, pose), self.reader.cell_sizes
        cells, present = jnp.asarray(frame.cells), None if frame.present is None else jnp.asarray(frame.present)
        hidden = None if self.reader.occluders is None else self.reader.occluders.cells
        seen = (cells, sizes, self.reader.subject, present, hidden)
        evidence = blob_evidence(self.limbs, posed, self.cameras, windows, *seen)
        fit = frame_fit(self.limbs, evidence, posed, self.cameras, windows)
        found = limb_confidence(self.limbs, evidence, baseline, windows is not None)
        return replace(found, explained=fit.explained, overlap=fit.overlap)

    def solved(
        self,
        objective: FrameEnergy,
        start: Float[Array, "dof"],
        capacities: Capacities,
        most: Int[Array, ""] | None = None,
    ) -> tuple[Solution, Int[Array, ""]]:
        """What the solver finds from a pose, and how many blocks of near pairs that needs room for.

        `most` bounds the iterations of all rounds together; None: each makes as many as the solver may.
        """
        if self.pairs == "sparse":
            return solve_near(self.solver, objective, start, self.scales, capacities.blocks, most)
        return bounded(self.solver, most).maximize(objective, start, self.scales), jnp.asarray(0)
