"""Linear systems of a clip: blocks along time that touch their two neighbours, and parameters that all share.

The poses of a clip make a banded matrix, since a second difference joins three frames at most; the shape of the body,
which every frame feels, makes the last columns full: an arrow. Frames are eliminated one after the other, then the
shape's Schur complement is solved. Blocks of this size stay below what BLAS shares among threads: LAPACK's banded
Cholesky does not, and takes a hundred times as long on a busy machine.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

Blocks = Float[np.ndarray, "frame dof dof"]


@dataclass(frozen=True)
class ArrowSystem:
    """A quadratic model of poses and shared parameters: `gradient . d - d . curvature d / 2`."""

    own: Blocks
    """Curvature of each frame."""
    next: Blocks
    """Blocks between each frame (rows) and the one after it (columns); the last one is 0."""
    after_next: Float[np.ndarray, "frame dof"]
    """Diagonals between each frame and the one after the next; the last two are 0."""
    cross: Float[np.ndarray, "frame dof shared"]
    """Blocks between each frame and the shared parameters."""
    corner: Float[np.ndarray, "shared shared"]
    gradient: Float[np.ndarray, "frame dof"]
    shared_gradient: Float[np.ndarray, "shared"]

    def step(
        self, damping: Float[np.ndarray, "frame dof"], shared_damping: Float[np.ndarray, "shared"]
    ) -> tuple[Float[np.ndarray, "frame dof"], Float[np.ndarray, "shared"]] | None:
        """The step to the maximum of the damped model; None where it has none."""
        count = self.cross.shape[-1]
        try:
            solved = self._solved(damping)
            alone, cross = solved[..., 0], solved[..., 1:]
            shared = np.zeros(count)
            if count:
                gradient, curvature = self._followed(alone, cross)
                shared = np.linalg.solve(curvature + np.diag(shared_damping), gradient)
        except np.linalg.LinAlgError:
            return None
        return alone - np.einsum("tis,s->ti", cross, shared), shared

    def of_shared(
        self, damping: Float[np.ndarray, "frame dof"]
    ) -> tuple[Float[np.ndarray, "shared"], Float[np.ndarray, "shared shared"]]:
        """Gradient and curvature by the shared parameters alone, the poses following them."""
        solved = self._solved(damping)
        return self._followed(solved[..., 0], solved[..., 1:])

    def _followed(
        self, alone: Float[np.ndarray, "frame dof"], cross: Float[np.ndarray, "frame dof shared"]
    ) -> tuple[Float[np.ndarray, "shared"], Float[np.ndarray, "shared shared"]]:
        gradient = self.shared_gradient - np.einsum("tis,ti->s", self.cross, alone)
        return gradient, self.corner - np.einsum("tis,tir->sr", self.cross, cross, optimize=True)

    def restricted(self, free: Bool[np.ndarray, "shared"]) -> "ArrowSystem":
        """The system with only some of the shared parameters; the others stay as they are."""
        return replace(
            self,
            cross=self.cross[..., free],
            corner=self.corner[np.ix_(free, free)],
            shared_gradient=self.shared_gradient[free],
        )

    def expected_gain(self, poses: Float[np.ndarray, "frame dof"], shared: Float[np.ndarray, "shared"]) -> float:
        """How far the model rises along a step."""
        bend = np.einsum("tij,tj->ti", self.own, poses) + np.einsum("tis,s->ti", self.cross, shared)
        forward = np.einsum("tij,tj->ti", self.next[:-1], poses[1:])
        backward = np.einsum("tji,tj->ti", self.next[:-1], poses[:-1])
        bend[:-1] += forward
        bend[1:] += backward
        bend[:-2] += self.after_next[:-2] * poses[2:]
        bend[2:] += self.after_next[:-2] * poses[:-2]
        shared_bend = np.einsum("tis,ti->s", self.cross, poses) + self.corner @ shared
        rise = np.sum(poses * (self.gradient - 0.5 * bend))
        return float(rise + np.sum(shared * (self.shared_gradient - 0.5 * shared_bend)))

    def _solved(self, damping: Float[np.ndarray, "frame dof"]) -> Float[np.ndarray, "frame dof column"]:
        """The poses' damped matrix solved for the gradient (first column) and the shared parameters' columns."""
        frames, dofs = self.gradient.shape
        right = np.concatenate([self.gradient[..., None], self.cross], axis=-1)
        own, beside = self.own.copy(), self.next.copy()
        own[:, np.arange(dofs), np.arange(dofs)] += damping
        by_next, by_after = np.zeros((2, frames, dofs, dofs))
        for t in range(frames):
            found = np.linalg.solve(own[t], np.column_stack([beside[t], np.diag(self.after_next[t]), right[t]]))
            by_next[t], by_after[t], right_t = found[:, :dofs], found[:, dofs : 2 * dofs], found[:, 2 * dofs :]
            if t + 1 < frames:
                own[t + 1] -= beside[t].T @ by_next[t]
                right[t + 1] -= beside[t].T @ right_t
                beside[t + 1] -= beside[t].T @ by_after[t]
            if t + 2 < frames:
                own[t + 2] -= self.after_next[t][:, None] * by_after[t]
                right[t + 2] -= self.after_next[t][:, None] * right_t
            right[t] = right_t
        for t in range(frames - 2, -1, -1):
            right[t] -= by_next[t] @ right[t + 1]
            if t + 2 < frames:
                right[t] -= by_after[t] @ right[t + 2]
        return right
