"""A body: a skeleton and the coloured blobs attached to it (Section 4.2); an actor is a body fitted to one subject."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.scipy.linalg import block_diag
from jaxtyping import Array, Float, Int

from sogjax.model.rotation import transform_points
from sogjax.model.skeleton import Skeleton
from sogjax.model.sog import Sog


@dataclass(frozen=True)
class ShapeGroup:
    """Lengths and sizes of a body that are scaled together by one shape parameter (Section 5.2)."""

    name: str
    joint_offsets: tuple[str, ...] = ()
    """Joints whose offset from their parent is scaled (a bone length)."""
    blob_offsets: tuple[str, ...] = ()
    """Blobs whose offset from their joint is scaled."""
    blob_sigmas: tuple[str, ...] = ()
    """Blobs whose size is scaled."""
    landmark_offsets: tuple[str, ...] = ()
    """Landmarks whose offset from their joint is scaled."""


class Attachments(eqx.Module):
    """Named points fixed to joints: landmarks, or the centres of the blobs."""

    names: tuple[str, ...] = eqx.field(static=True)
    joints: tuple[int, ...] = eqx.field(static=True)
    offsets: Float[Array, "point 3"]
    """Metres, in the frame of the point's joint."""

    def points_world(self, world_from_joint: Float[Array, "joint 4 4"]) -> Float[Array, "point 3"]:
        """The points in the world, given the joints' frames."""
        return transform_points(world_from_joint[np.array(self.joints, int)], self.offsets)


class Body(eqx.Module):
    """A skeleton with blobs, landmarks and named poses; lengths in metres.

    In the rest pose a body stands in its own frame: x forward, y to its left, z up.
    """

    name: str = eqx.field(static=True)
    skeleton: Skeleton
    blobs: Attachments
    blob_sigmas: Float[Array, "blob"]
    blob_colors: Float[Array, "blob 3"]
    """SRGB in 0..1."""
    landmarks: Attachments
    poses: dict[str, Float[Array, "dof"]]
    shape_groups: tuple[ShapeGroup, ...] = eqx.field(static=True, default=())
    explained: Float[Array, ""] = eqx.field(default_factory=lambda: jnp.zeros((), jnp.float32))
    """The part of an actor that its example poses explain (0 to 1); 0 where that is not known."""

    @property
    def num_blobs(self) -> int:
        """Number of blobs; none of them is padding."""
        return len(self.blobs.names)

    @property
    def blob_actors(self) -> Int[np.ndarray, "blob"]:
        """The number of the actor (tree of the skeleton) that each blob belongs to."""
        return np.array(self.skeleton.trees, int)[np.array(self.blobs.joints, int)]

    def posed_blobs(self, pose: Float[Array, "dof"]) -> Sog:
        """The blobs in the world in `pose` (sRGB colours)."""
        return Sog(
            means=self.blobs.points_world(self.skeleton.world_from_joint(pose)),
            sigmas=self.blob_sigmas,
            colors=self.blob_colors,
            mask=jnp.ones(self.num_blobs, bool),
        )

    def posed_landmarks(self, pose: Float[Array, "dof"]) -> Float[Array, "landmark 3"]:
        """The landmarks in the world in `pose`."""
        return self.landmarks.points_world(self.skeleton.world_from_joint(pose))

    def rotated(self, rotation: Float[Array, "3 3"]) -> "Body":
        """The same body with its rest frame turned, so that it stands upright in a world with another vertical."""
        turn = lambda vectors: jnp.einsum("ij,nj->ni", rotation, vectors, precision="highest")
        return eqx.tree_at(
            lambda b: (b.skeleton.offsets, b.skeleton.axes, b.blobs.offsets, b.landmarks.offsets),
            self,
            replace_fn=turn,
        )


def concatenate(bodies: Sequence[Body]) -> Body:
    """Several bodies as one model with one pose vector; names get the prefix `ACTOR/` (one body stays as it is).

    Named poses other than `rest` are dropped: they belong to one actor each.
    """
    if len(bodies) == 1:
        return bodies[0]
    skeletons = [body.skeleton for body in bodies]
    first_joint = np.cumsum([0] + [skeleton.num_joints for skeleton in skeletons])
    prefix = lambda body, names: tuple(f"{body.name}/{name}" for name in names)
    flat = lambda parts: tuple(item for part in parts for item in part)
    join = lambda field: jnp.concatenate([field(body) for body in bodies])

    def attachments(field: str) -> Attachments:
        parts: list[Attachments] = [getattr(body, field) for body in bodies]
        return Attachments(
            names=flat(prefix(body, part.names) for body, part in zip(bodies, parts, strict=True)),
            joints=flat(
                tuple(j + int(first) for j in part.joints) for part, first in zip(parts, first_joint[:-1], strict=True)
            ),
            offsets=jnp.concatenate([part.offsets for part in parts]),
        )

    skeleton = Skeleton(
        names=flat(prefix(body, body.skeleton.names) for body in bodies),
        parents=flat(
            tuple(p if p < 0 else p + int(first) for p in part.parents)
            for part, first in zip(skeletons, first_joint[:-1], strict=True)
        ),
        dof_names=flat(prefix(body, body.skeleton.dof_names) for body in bodies),
        offsets=join(lambda body: body.skeleton.offsets),
        axes=join(lambda body: body.skeleton.axes),
        revolute=join(lambda body: body.skeleton.revolute),
        parameter_transform=block_diag(*(skeleton.parameter_transform for skeleton in skeletons)),
        dof_lower=join(lambda body: body.skeleton.dof_lower),
        dof_upper=join(lambda body: body.skeleton.dof_upper),
    )
    return Body(
        name="+".join(body.name for body in bodies),
        skeleton=skeleton,
        blobs=attachments("blobs"),
        blob_sigmas=join(lambda body: body.blob_sigmas),
        blob_colors=join(lambda body: body.blob_colors),
        landmarks=attachments("landmarks"),
        poses={"rest": join(lambda body: body.poses["rest"])},
    )


def dof_slices(bodies: Sequence[Body]) -> list[slice]:
    """The slices of the concatenated pose that hold each body's degrees of freedom."""
    ends = np.cumsum([0, *(body.skeleton.num_dofs for body in bodies)])
    return [slice(int(first), int(stop)) for first, stop in pairwise(ends)]
