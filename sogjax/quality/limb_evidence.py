"""The limbs of a body, of all actors, as arrays for the compiled step.

What the pictures say for and against the blobs of a body, where a pose puts them.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, UInt8

from sogjax.energy.posed import Posed
from sogjax.energy.views import Windows
from sogjax.model.body import Body
from sogjax.model.camera import Camera, cells_at, point_depths, project
from sogjax.model.color import SHADING, SPREAD
from sogjax.model.limbs import limb_blobs
from sogjax.model.sog import Sog
from sogjax.scene.foreground import LARGEST_UNKNOWN, SubjectColors, own_color, own_density, subject_density

WORST = 1.0 / 3.0
"""Part of a limb's blobs that is looked at: those that fit worst, as a limb is lost from some joint on."""


class LimbBlobs(eqx.Module):
    """Which blobs are a limb's."""

    members: Bool[Array, "limb blob"]
    worst: Float[Array, "limb blob"]
    """What each of a limb's blobs counts, in the order of how well they fit, the worst first."""
    of_other_parts: Float[Array, "blob blob"]
    """1 for two blobs of different limbs, or of which one belongs to none; else 0."""
    actor_of_blob: tuple[int, ...] = eqx.field(static=True)

    @classmethod
    def from_body(cls, body: Body) -> "LimbBlobs":
        """The limbs of a body, or of several beside each other."""
        members = limb_blobs(body)
        counts = np.ceil(WORST * members.sum(axis=1, keepdims=True))
        worst = (np.arange(members.shape[1]) < counts) / np.maximum(counts, 1.0)
        parts = np.where(members.any(axis=0), members.argmax(axis=0), -1) if len(members) else np.zeros(body.num_blobs)
        return cls(
            members=jnp.asarray(members),
            worst=jnp.asarray(worst, body.blob_sigmas.dtype),
            of_other_parts=jnp.asarray(parts[:, None] != parts[None, :], body.blob_sigmas.dtype),
            actor_of_blob=tuple(body.blob_actors.tolist()),
        )

    def mean_of_worst(self, values: Float[Array, "blob"]) -> Float[Array, "limb"]:
        """The mean of the lowest third of the values of each limb's blobs."""
        ordered = jnp.sort(jnp.where(self.members, values[None, :], jnp.inf), axis=1)
        return jnp.sum(jnp.where(self.worst > 0.0, ordered, 0.0) * self.worst, axis=1)


SAMPLES = ((0.0, 0.0), (0.6, 0.0), (-0.6, 0.0), (0.0, 0.6), (0.0, -0.6))
"""Where a blob is looked at, in units of its size."""
DEPTH_SCALE = 0.16
"""Metres of depth over which a blob comes to hide another."""
TOUCHING, INSIDE = 1.3, 0.25
"""Sigmas from a blob's middle to its surface. Two touch where their depths differ by as much as both have; one is
behind the other from the part `INSIDE` of that on, and wholly so from one minus that part on."""
DENSITY = 2.0
"""Density of a blob's middle along a ray, as in the foreground term."""
BACKGROUND = -0.3
"""Log odds below which a sample contradicts a blob, as far as its colour is another."""
CLEARLY = LARGEST_UNKNOWN
"""Log odds from which a cell is foreground, and below minus which it is background; others do not count, and none whose
background is unknown."""
DARKEST = 0.05
"""A limb's light, at least: nothing is told of colours that are nearly black."""


class Visible(NamedTuple):
    """What other parts of a body leave of its blobs in each picture."""

    part: Float[Array, "camera blob"]
    """How much of each blob's middle is visible."""
    of_solids: Float[Array, "camera blob"]
    """Likewise, by the size of both instead of `DEPTH_SCALE`: of two in one place, neither hides the other."""
    hider: Int[Array, "camera blob"]
    """The blob that covers most of it by that measure, whose colour stands for all; the first where none does."""


class BlobEvidence(NamedTuple):
    """The evidence for each blob, over all cameras, where other limbs and the trunk do not hide it."""

    own: Float[Array, "blob"]
    """Log likelihood of the colours seen, in the limb's light, as the blob's own (of one behind another, as those of
    either) against any of the subject's; mean of the samples."""
    contradicted: Float[Array, "blob"]
    """Part of the samples that are background; 0 where none is known. What looks like the background and like the blob
    is either: it counts as far as the blob's own colour is another."""
    seen: Float[Array, "blob"]
    """Part of its area in all pictures that is seen."""
    explained: Float[Array, "blob"]
    """How far the samples show the blob's own colours (0 to 1), and no clear background; their mean."""
    hidden: Float[Array, "blob"] | None = None
    """Part of what no other limb hides that is hidden by things in front; None: nothing is in front."""


def blob_evidence(
    limbs: LimbBlobs,
    posed: Posed,
    cameras: Camera,
    windows: Windows | None,
    cells: UInt8[Array, "camera rows columns 3"],
    cell_sizes: Float[Array, "camera"],
    subject: SubjectColors,
    present: Bool[Array, "camera"] | None = None,
    hidden_from: Float[Array, "camera rows columns"] | None = None,
) -> BlobEvidence:
    """The evidence for a posed body.

    `windows` is None where no background is known; `present` are the cameras that have a picture (None: all);
    `hidden_from` are the depths from which on cells are hidden (metres; None: nothing is in front).
    """
    seen = jax.vmap(project, in_axes=(0, None))(cameras, posed.blobs)
    sigmas = jnp.where(seen.mask, seen.sigmas, 1.0)
    samples = jnp.asarray(SAMPLES, sigmas.dtype)[None, None]
    places = seen.means[:, :, None] + sigmas[:, :, None, None] * samples
    cell, inside = jax.vmap(_cells_of)(cameras, cell_sizes, places)
    camera = np.arange(places.shape[0])[:, None, None]
    colors = cells[camera, cell[..., 1], cell[..., 0]].astype(places.dtype) / 255.0
    if present is not None:
        inside &= present[:, None, None]
    own_colors = posed.body.blob_colors[None, :, None]
    alike = own_color(colors, own_colors)
    odds = jnp.zeros(inside.shape) if windows is None else _odds_at(limbs, windows, places)
    against = odds < BACKGROUND
    areas = jnp.where(seen.mask, seen.sigmas, 0.0) ** 2
    visible = visible_parts(limbs, posed.blobs, seen, cameras)
    weights = jnp.where(inside, (areas * visible.part)[:, :, None], 0.0)
    hidden = None
    if hidden_from is not None:
        depths = jax.vmap(point_depths, in_axes=(0, None))(cameras, posed.blobs.means)
        shown = jnp.where(depths[:, :, None] < hidden_from[camera, cell[..., 1], cell[..., 0]], weights, 0.0)
        hidden = 1.0 - (jnp.sum(shown, axis=(0, 2)) + 1e-6) / (jnp.sum(weights, axis=(0, 2)) + 1e-6)
        weights = shown
    whole = jnp.sum(weights, axis=(0, 2)) + 1e-6
    mean = lambda values: jnp.sum(weights * values, axis=(0, 2)) / whole
    shares = jnp.where(against, 0.0, weights) / jnp.maximum(len(SAMPLES) * areas, 1e-6)[:, :, None]
    light = _light(limbs, colors, own_colors, shares)
    return BlobEvidence(
        own=mean(_own(colors, own_colors, light, visible, subject)),
        contradicted=mean(jnp.where(against, 1.0 - alike, 0.0)),
        seen=whole / (len(SAMPLES) * jnp.sum(areas, axis=0) + 1e-6),
        explained=mean(jnp.where(odds < -CLEARLY, 0.0, alike)),
        hidden=hidden,
    )


def _light(
    limbs: LimbBlobs,
    colors: Float[Array, "camera blob sample 3"],
    own_colors: Float[Array, "1 blob 1 3"],
    shares: Float[Array, "camera blob sample"],
) -> Float[Array, "camera blob"]:
    """How bright each blob's limb is seen in each camera, as a multiple of its own colours; 1 for the trunk's.

    A limb that turns towards a lamp is brighter as a whole: that is one fact, not one for each of its blobs. The
    multiple that fits best by least squares, which is expected to be within `SHADING` of 1.
    """
    of_limbs = lambda values: jnp.matmul(jnp.sum(shares * values, axis=2), limbs.members.T.astype(shares.dtype))
    both, own = (jnp.sum(seen * own_colors, axis=-1) for seen in (colors, jnp.broadcast_to(own_colors, colors.shape)))
    expected = (SPREAD / SHADING) ** 2
    light = (of_limbs(both) + expected) / (of_limbs(own) + expected)
    of_blobs = jnp.matmul(light, limbs.members.astype(light.dtype))
    return jnp.where(jnp.any(limbs.members, axis=0)[None], jnp.maximum(of_blobs, DARKEST), 1.0)


def _cells_of(
    camera: Camera, cell_size: Float[Array, ""], places: Float[Array, "blob sample 2"]
) -> tuple[Int[Array, "blob sample 2"], Bool[Array, "blob sample"]]:
    """The cells (column, row) at undistorted pixels of one camera, and which of these are in its picture."""
    cell, inside = cells_at(camera, cell_size, places.reshape(-1, 2))
    return cell.reshape(*places.shape[:2], 2), inside.reshape(places.shape[:2])


def visible_parts(limbs: LimbBlobs, blobs: Sog, seen: Sog, cameras: Camera) -> Visible:
    """What blobs of other parts of a body leave visible of each blob, and which of them may hide it."""
    sigmas = jnp.where(seen.mask, seen.sigmas, 1.0)
    depths = blobs.sigmas[None, :] * cameras.focal_length[:, None] / sigmas
    apart = sum((seen.means[:, :, None, k] - seen.means[:, None, :, k]) ** 2 for k in range(2))
    height = jnp.where(seen.mask, DENSITY, 0.0)[:, :, None] * limbs.of_other_parts[None]
    covering = height * jnp.exp((-0.5 / sigmas**2)[:, :, None] * apart)
    farther = depths[:, None, :] - depths[:, :, None]
    touching = TOUCHING * (blobs.sigmas[:, None] + blobs.sigmas[None, :])
    left = lambda hiding: jnp.where(seen.mask, jnp.exp(-jnp.sum(hiding, axis=1)), 0.0)
    before = covering * jnp.clip(farther / DEPTH_SCALE + 0.5, 0.0, 1.0)
    outside = covering * jnp.clip((farther / touching[None] - INSIDE) / (1.0 - 2.0 * INSIDE), 0.0, 1.0)
    return Visible(left(before), left(outside), jnp.argmax(outside, axis=1))


def _own(
    colors: Float[Array, "camera blob sample 3"],
    own_colors: Float[Array, "1 blob 1 3"],
    light: Float[Array, "camera blob"],
    visible: Visible,
    subject: SubjectColors,
) -> Float[Array, "camera blob sample"]:
    """Log likelihood of colours as a blob's own, or its hider's, each in its limb's light, against any of a subject."""

    def against_any(light: Float[Array, "camera blob"], own: Float[Array, "*#camera blob 3"]) -> Array:
        lit = jnp.clip(colors / light[:, :, None, None], 0.0, 1.0)
        return own_density(lit, own[..., None, :]) - subject_density(lit, subject)

    hiders_light = jnp.take_along_axis(light, visible.hider, axis=1)
    as_hider = against_any(hiders_light, own_colors[0, :, 0][visible.hider])
    return own_or_hidden(against_any(light, own_colors[:, :, 0]), as_hider, visible.of_solids[:, :, None])


def own_or_hidden(
    own: Float[Array, "*place"], hiding: Float[Array, "*place"], visible: Float[Array, "*#place"]
) -> Float[Array, "*place"]:
    """Log likelihood of colours as a blob's own or, by the odds that it is hidden (at most even), as its hider's.

    A limb close behind another is still partly looked at, as depths are not exact; what is seen may be the other's.
    """
    odds = 1.0 / jnp.maximum(visible, 0.5) - 1.0
    return jnp.logaddexp(own, hiding + jnp.log(odds))


def _odds_at(
    limbs: LimbBlobs, windows: Windows, places: Float[Array, "camera blob sample 2"]
) -> Float[Array, "camera blob sample"]:
    """Log odds of foreground in the windows of the blobs' actors; 0 outside them."""
    actors = np.array(limbs.actor_of_blob, int)
    first = jnp.stack([windows.x[..., 0], windows.y[..., 0]], axis=-1)[:, actors, None]
    cell = jnp.floor((places - first) / windows.step[:, actors, None] + 0.5)
    columns, rows = windows.odds.shape[-2:]
    inside = jnp.all(cell >= 0.0, axis=-1) & (cell[..., 0] < columns) & (cell[..., 1] < rows)
    cell = jnp.where(inside[..., None], cell, 0.0).astype(jnp.int32)
    camera = np.arange(places.shape[0])[:, None, None]
    return jnp.where(inside, windows.odds[camera, actors[None, :, None], cell[..., 0], cell[..., 1]], 0.0)
