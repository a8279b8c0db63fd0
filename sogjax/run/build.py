"""From settings to the modules of the core: the only place that knows both."""

from collections.abc import Sequence
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from sogjax.energy.frame_energy import standard_terms
from sogjax.energy.keypoints import KeypointTerm
from sogjax.energy.overlap import EXACT_EXPONENT, PRINTED_EXPONENT
from sogjax.energy.priors import RestPenalty, pose_spread
from sogjax.energy.term import Term, Terms, added_terms
from sogjax.energy.views import whole_image_overlap
from sogjax.errors import InputError
from sogjax.io.painted import painted_masks
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.model.camera import Camera
from sogjax.model.color import COLOR_RADIUS
from sogjax.model.solid import Solid
from sogjax.quality.limb_evidence import LimbBlobs
from sogjax.quality.markers import MARKER_RULES, MarkerRule
from sogjax.run.background import CHOICES, Background
from sogjax.run.clip import Clip
from sogjax.scene.foreground import SubjectColors, subject_colors
from sogjax.scene.occluders import painted
from sogjax.scene.quadtree import Candidates
from sogjax.settings.method import ColorConfig, EnergyConfig, ImagesConfig, SolverConfig
from sogjax.settings.run import TrackConfig
from sogjax.solve.ascent import ConditionedAscent, gradient_ascent
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.solve.optimistix import OptimistixSolver
from sogjax.solve.solution import Solver
from sogjax.tracking.culling import BoxAround, ImageReader
from sogjax.tracking.solving import pose_scales
from sogjax.tracking.tracker import PairChoice, Tracker

MAX_DEPTH = 12
"""Depth of a quad-tree, at most: one pixel of the largest pictures cameras take."""
OPTIMISTIX_METHODS = ("bfgs", "lbfgs", "nonlinear_cg")


def one_of(key: str, value: str, allowed: Sequence[str]) -> str:
    """The value, if it is allowed.

    Raises:
        InputError: it is not.
    """
    if value not in allowed:
        raise InputError(f"{key}={value}: no such choice; use one of {', '.join(allowed)}")
    return value


def at_least(key: str, value: float | int, bound: float | int) -> float | int:
    """The value, if it is a finite number not below the bound.

    Raises:
        InputError: it is not.
    """
    if not value >= bound or not np.isfinite(value):
        raise InputError(f"{key}={value}: must be a number of at least {bound:g}")
    return value


def between(key: str, value: float | int, low: float | int, high: float | int) -> float | int:
    """The value, if it lies between the bounds.

    Raises:
        InputError: it does not.
    """
    if not low <= value <= high:
        raise InputError(f"{key}={value}: must lie between {low:g} and {high:g}")
    return value


def check(config: TrackConfig) -> None:
    """Check every setting before any work begins.

    Raises:
        InputError: a value that is no valid choice or is out of range.
    """
    color_space_and_radius(config.color)
    energy_terms(config.energy)
    pair_choice(config.energy)
    solver(config.solver)
    between("images.depth", config.images.depth, 1, MAX_DEPTH)
    between("tracking.extrapolation", config.tracking.extrapolation, 0.0, 2.0)
    if not np.isfinite(config.images.color_tolerance):
        raise InputError(f"images.color_tolerance={config.images.color_tolerance}: must be a number")
    at_least("energy.keypoint_weight", config.energy.keypoint_weight, 0.0)
    at_least("energy.rest_weight", config.energy.rest_weight, 0.0)
    box_around(config.images)
    one_of("images.background", config.images.background, CHOICES)
    at_least("every", config.every, 1)
    at_least("outputs.overlay_width", config.outputs.overlay_width, 64)


def color_space_and_radius(config: ColorConfig) -> tuple[str, float]:
    """The colour space and its eps_sim."""
    space = one_of("color.space", config.space, tuple(COLOR_RADIUS))
    radius = COLOR_RADIUS[space] if config.radius is None else config.radius
    return space, at_least("color.radius", radius, 1e-6)


def energy_terms(config: EnergyConfig, further: Sequence[Term] = ()) -> Terms:
    """The terms of Eq. 10, those that the settings add, and further ones.

    Raises:
        InputError: a value that is no valid choice or is out of range, a term that cannot be made, or two terms of one
            name.
    """
    exponent = one_of("energy.overlap_exponent", config.overlap_exponent, ("exact", "printed"))
    standard = standard_terms(
        limit_weight=at_least("energy.limit_weight", config.limit_weight, 0.0),
        acceleration_weight=at_least("energy.acceleration_weight", config.acceleration_weight, 0.0),
        exponent=EXACT_EXPONENT if exponent == "exact" else PRINTED_EXPONENT,
        capped=config.capped,
        foreground_weight=at_least("energy.foreground_weight", config.foreground_weight, 0.0),
    )
    terms = (*standard, *added_terms("energy.terms", config.terms, [term.name for term in standard]), *further)
    for term in further:
        if not isinstance(term, Term):
            raise InputError(f"terms: {term!r} is not a sogjax.Term; give instances, such as Floor(weight=2.0)")
    names = [term.name for term in terms]
    if len(set(names)) < len(names):
        raise InputError(f"terms: two terms are named {max(names, key=names.count)!r}; give each its own `name`")
    return terms


def box_around(config: ImagesConfig) -> BoxAround:
    """Which poses the culling box holds."""
    return "last" if one_of("images.box_around", config.box_around, ("predicted", "last")) == "last" else "predicted"


def marker_rule(value: str, key: str) -> MarkerRule:
    """How markers are attached to a motion."""
    return "closest" if one_of(key, value, MARKER_RULES) == "closest" else "scaled"


def pair_choice(config: EnergyConfig) -> PairChoice:
    """Which pairs of blobs are compared."""
    return "sparse" if one_of("energy.pairs", config.pairs, ("dense", "sparse")) == "sparse" else "dense"


def solver(config: SolverConfig) -> Solver:
    """The solver that a config names."""
    methods = ("conditioned_ascent", "gradient_ascent", "gauss_newton", *OPTIMISTIX_METHODS)
    method = one_of("solver.method", config.method, methods)
    at_least("solver.epsilon", config.epsilon, 0.0)
    at_least("solver.max_iterations", config.max_iterations, 1)
    between("solver.min_iterations", config.min_iterations, 0, config.max_iterations)
    if method in OPTIMISTIX_METHODS:
        return OptimistixSolver(method, epsilon=config.epsilon, max_iterations=config.max_iterations)
    if method == "gauss_newton":
        return GaussNewton(
            epsilon=config.epsilon, min_iterations=config.min_iterations, max_iterations=config.max_iterations
        )
    ascent = ConditionedAscent if method == "conditioned_ascent" else gradient_ascent
    return ascent(epsilon=config.epsilon, min_iterations=config.min_iterations, max_iterations=config.max_iterations)


def device_cameras(recording: Recording) -> Camera:
    """The recording's cameras in jax's working precision."""
    return jax.tree.map(jnp.asarray, recording.rig.cameras)


def image_reader(clip: Clip, background: Background, config: TrackConfig, bodies: Sequence[Body] = ()) -> ImageReader:
    """What turns the cells of a frame into image blobs, with the colours of the actors, if there are any."""
    space, radius = color_space_and_radius(config.color)
    reader = ImageReader(
        candidates=Candidates.from_grids(clip.grids, device_cameras(clip.recording)),
        color_radius=radius,
        color_tolerance=config.images.color_tolerance,
        color_space=space,
        box_around=box_around(config.images),
        background=background.model(clip.grids),
        subject=_subject(bodies) if bodies else None,
    )
    return reader.behind(painted(painted_masks(clip.recording), clip.grids)) if clip.recording.occluders else reader


def tracker(clip: Clip, background: Background, body: Body, config: TrackConfig, terms: Sequence[Term] = ()) -> Tracker:
    """The tracker of a clip for a body that stands upright in its world, with further terms of the energy."""
    cameras = device_cameras(clip.recording)
    return Tracker(
        body=body,
        cameras=cameras,
        normalizers=whole_image_overlap(cameras.image_size),
        reader=image_reader(clip, background, config, [body]),
        terms=_tracking_terms(config.energy, body, terms),
        solver=solver(config.solver),
        scales=pose_scales(body.skeleton),
        extrapolation=config.tracking.extrapolation,
        pairs=pair_choice(config.energy),
        limbs=LimbBlobs.from_body(body) if config.outputs.confidence else None,
        solid=Solid.of(body) if config.tracking.both_ways else None,
    )


def varied(tracker: Tracker, config: TrackConfig) -> Tracker:
    """The same tracker with the numbers of other settings; pictures and colour space must be the same."""
    keypoints = [term for term in tracker.terms if isinstance(term, KeypointTerm)]
    reader = replace(
        tracker.reader,
        color_radius=color_space_and_radius(config.color)[1],
        color_tolerance=config.images.color_tolerance,
        box_around=box_around(config.images),
    )
    return replace(
        tracker,
        reader=reader,
        terms=_tracking_terms(config.energy, tracker.body, keypoints),
        solver=solver(config.solver),
        scales=pose_scales(tracker.body.skeleton),
        extrapolation=config.tracking.extrapolation,
        pairs=pair_choice(config.energy),
        limbs=LimbBlobs.from_body(tracker.body) if config.outputs.confidence else None,
    )


def _tracking_terms(config: EnergyConfig, body: Body, further: Sequence[Term]) -> Terms:
    """The energy's terms, and being near rest: initial poses, from which one is chosen, may be any."""
    rest = [RestPenalty(config.rest_weight, pose_spread(body))] if config.rest_weight else []
    return energy_terms(config, [*rest, *further])


def _subject(bodies: Sequence[Body]) -> SubjectColors:
    """The colours of all actors."""
    colors = np.concatenate([np.asarray(body.blob_colors) for body in bodies])
    areas = np.concatenate([np.asarray(body.blob_sigmas) ** 2 for body in bodies])
    return jnp.asarray(subject_colors(colors, areas), jnp.result_type(float))
