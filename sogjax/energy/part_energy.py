"""The energy of a part of a body, such as a pair of limbs, while the rest of it is held.

What the rest explains is taken from the pictures: from the caps of Eq. 8, and from the odds of the foreground term
where it covers. What is left is the same energy of a few blobs, so that many ways to hold a limb can be compared.
"""

from collections.abc import Sequence
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.foreground import Foreground, cover
from sogjax.energy.image_term import ImageTerm, images_model
from sogjax.energy.overlap import overlaps
from sogjax.energy.posed import Frame, History, Posed
from sogjax.energy.priors import LimitPenalty
from sogjax.energy.similarity import similarity_among
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.model.body import Body
from sogjax.model.camera import project
from sogjax.model.sog import Sog
from sogjax.solve.solution import QuadraticModel

MOST_IMAGE_BLOBS = 192
"""Image blobs of a camera that a part is compared with: those that it could explain most of."""


class PartIndex(eqx.Module):
    """Which degrees of freedom and blobs of a body are those of a part, padded to one size for all parts."""

    dofs: Int[Array, "*part param"]
    dof_mask: Bool[Array, "*part param"]
    blobs: Int[Array, "*part slot"]
    blob_mask: Bool[Array, "*part slot"]

    @classmethod
    def of(cls, dofs: Sequence[Int[np.ndarray, "_param"]], blobs: Sequence[Int[np.ndarray, "_slot"]]) -> "PartIndex":
        """Some parts, padded to the largest."""
        return cls(*map(jnp.asarray, (*_padded(dofs), *_padded(blobs))))

    @classmethod
    def whole(cls, body: Body) -> "PartIndex":
        """All of a body."""
        every = cls.of([np.arange(body.skeleton.num_dofs)], [np.arange(body.num_blobs)])
        return jax.tree.map(lambda leaf: leaf[0], every)

    def params(self, pose: Float[Array, "dof"]) -> Float[Array, "param"]:
        """The part of a pose; 0 in the padding."""
        return jnp.where(self.dof_mask, pose[self.dofs], 0.0)

    def put(self, pose: Float[Array, "dof"], params: Float[Array, "param"]) -> Float[Array, "dof"]:
        """A pose with the part held in another way."""
        return pose.at[jnp.where(self.dof_mask, self.dofs, pose.shape[0])].set(params, mode="drop")

    def blobs_of(self, blobs: Sog) -> Sog:
        """The blobs of the part."""
        taken = jax.tree.map(lambda leaf: leaf[self.blobs], blobs)
        return eqx.tree_at(lambda sog: sog.mask, taken, taken.mask & self.blob_mask)

    def rest_of(self, blobs: Sog) -> Sog:
        """All blobs, those of the part masked out."""
        mask = blobs.mask.at[jnp.where(self.blob_mask, self.blobs, blobs.capacity)].set(False, mode="drop")
        return eqx.tree_at(lambda sog: sog.mask, blobs, mask)


def _padded(rows: Sequence[Int[np.ndarray, "_n"]]) -> tuple[Int[np.ndarray, "row n"], Bool[np.ndarray, "row n"]]:
    """Rows of the same length, and what of them is real."""
    size = max(map(len, rows))
    return (
        np.stack([np.pad(row, (0, size - len(row))) for row in rows]),
        np.stack([np.arange(size) < len(row) for row in rows]),
    )


class PosedPart(Posed):
    """A posed body of which only a part is looked at."""

    jacobian: Float[Array, "blob 3 param"]

    def point_jacobian(self) -> Float[Array, "blob 3 param"]:
        """Derivatives of the part's blobs by its own degrees of freedom."""
        return self.jacobian


class PartEnergy(eqx.Module):
    """What a part adds to the energy of a frame, as a function of its own degrees of freedom; the rest is held."""

    body: Body
    views: Views
    """Of what is left."""
    terms: tuple[ImageTerm, ...]
    limits: LimitPenalty | None
    pose: Float[Array, "dof"]
    part: PartIndex

    @classmethod
    def around(cls, body: Body, views: Views, terms: Terms, pose: Float[Array, "dof"], part: PartIndex) -> "PartEnergy":
        """The energy of a part of a body that is otherwise held in a pose.

        Of the terms the similarity, the foreground's and the limits count.
        """
        limits = next((term for term in terms if isinstance(term, LimitPenalty)), None)
        left = left_for(views, terms, body.posed_blobs(pose), part)
        of_images = [similarity_among(terms), *(term for term in terms if isinstance(term, Foreground))]
        return cls(body, left, tuple(of_images), limits, pose, part)

    @property
    def frame(self) -> Frame:
        """What is left of the pictures, without history."""
        return Frame(self.views, History.unknown(self.pose))

    def __call__(self, params: Float[Array, "param"]) -> Float[Array, ""]:
        """The energy of the part."""
        whole = Posed.from_pose(self.body, self.part.put(self.pose, params))
        seen = sum((term.part(self._posed(whole), self.frame) for term in self.terms), jnp.zeros(()))
        return seen if self.limits is None else seen + self.limits.part(whole, self.frame)

    def quadratic(self, params: Float[Array, "param"]) -> QuadraticModel:
        """Value, gradient and a positive semi-definite curvature by the part's degrees of freedom."""
        whole = Posed.from_pose(self.body, self.part.put(self.pose, params))
        seen = images_model(self.terms, self._posed(whole), self.frame)
        if self.limits is None:
            return seen
        limits = self.limits.quadratic(whole, self.frame)
        mask, dofs = self.part.dof_mask.astype(params.dtype), self.part.dofs
        curvature = limits.curvature[dofs][:, dofs] * mask[:, None] * mask[None, :]
        return seen + QuadraticModel(limits.value, limits.gradient[dofs] * mask, curvature)

    def _posed(self, whole: Posed) -> PosedPart:
        body, blobs, shape = whole.body, self.part.blobs_of(whole.blobs), (1, 1, -1)
        joints = jnp.asarray(body.blobs.joints)[self.part.blobs]
        jacobian = body.skeleton.point_jacobian(whole.world_from_joint, joints, blobs.means, self.part.dofs)
        return PosedPart(
            body,
            whole.pose,
            whole.joint_params,
            whole.world_from_joint,
            blobs,
            jacobian * self.part.dof_mask.reshape(shape).astype(jacobian.dtype),
        )


def left_for(views: Views, terms: Terms, blobs: Sog, part: PartIndex) -> Views:
    """What the rest of a body (its blobs in the world) leaves to a part, in views in which all pairs are compared."""
    seen = jax.vmap(project, in_axes=(0, None))(views.cameras, part.rest_of(blobs))
    exponent = similarity_among(terms).exponent
    explained = lambda image, seen, similar: jnp.sum(overlaps(image, seen, similar, exponent), axis=0)
    caps = jnp.maximum(views.unexplained - jax.vmap(explained)(views.images, seen, views.color_similarities), 0.0)
    similar = jnp.where(part.blob_mask[None, :, None], views.color_similarities[:, part.blobs], 0.0)
    size = min(MOST_IMAGE_BLOBS, caps.shape[1])
    chosen = jax.lax.top_k(caps * jnp.max(similar, axis=1), size)[1]
    of_image = jax.vmap(lambda leaf, index: leaf[index])
    windows, foreground = views.windows, [term for term in terms if isinstance(term, Foreground)]
    if windows is not None and foreground:
        covered = jax.vmap(lambda w, s: cover(w, s, foreground[0].density))(windows, seen)
        windows = eqx.tree_at(lambda w: w.odds, windows, windows.odds * (1.0 - covered))
    return replace(
        views,
        images=jax.tree.map(lambda leaf: of_image(leaf, chosen), views.images),
        color_similarities=jnp.take_along_axis(similar, chosen[:, None, :], axis=2),
        caps=of_image(caps, chosen),
        windows=windows,
        pairs=None,
        coloring=None,
        keypoints=None,
    )
