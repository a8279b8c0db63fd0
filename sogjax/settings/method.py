"""The settings of the method: colours, pictures, energy, solver, prediction; the one place of their defaults."""

from dataclasses import dataclass
from typing import Any

from sogjax.settings.option import expert, option


@dataclass
class ColorConfig:
    """Colour space and similarity (Eq. 7)."""

    space: str = expert("hsv_shaded", "hsv_shaded | hsv_cylinder | hsv_cone | hsv (the paper's) | rgb | lab")
    radius: float | None = expert(None, "[eps_sim] colours farther apart do not match; null: the space's own")


@dataclass
class ImagesConfig:
    """Pictures to Sums of Gaussians (Section 4.1) and culling (Section 6)."""

    depth: int = option(8, "levels of the quad-tree below its root, the smallest power of two that holds a picture")
    color_tolerance: float = expert(0.1, "[eps_col] a node splits above this standard deviation; < 0: always")
    box_around: str = expert(
        "predicted", "predicted: an actor's box holds the last pose and the predicted one | last: the last"
    )
    background: str = option(
        "auto",
        "pictures: of the empty scene | clip: learnt from the clip | auto: those there are, else the clip | none",
    )
    cache: str | None = option(
        None, "folder for averaged pictures, so that later runs decode no video; null: none", inert=True
    )


@dataclass
class EnergyConfig:
    """The energy (Eq. 10)."""

    limit_weight: float = option(1.0, "[w_l] weight of the joint limits, 1/rad^2")
    acceleration_weight: float = option(0.01, "[w_a] weight of smooth motion, 1/rad^2")
    foreground_weight: float = expert(0.2, "weight of covering what is not background, and nothing that is; 0: off")
    rest_weight: float = expert(
        1e-5, "weight, while tracking, of joints that move or show little being near rest; 0: off"
    )
    keypoint_weight: float = expert(
        0.7, "weight of being near keypoints that other programs left beside the recording; 0: off"
    )
    overlap_exponent: str = expert("exact", "exact | printed: Eq. 6 with or without the 1/2 that Eq. 2 implies")
    capped: bool = expert(True, "the cap of Eq. 8 against blobs that hide each other")
    pairs: str = expert("sparse", "dense: all pairs of blobs | sparse: pairs near each other, equal to 1e-4")
    terms: Any = option(None, "further terms, {NAME:{term:MODULE.CLASS,weight:1}} with the class's numbers; null: none")


@dataclass
class SolverConfig:
    """The solver (Eq. 11, 12)."""

    method: str = expert(
        "gauss_newton", "conditioned_ascent | gradient_ascent | gauss_newton | bfgs | lbfgs | nonlinear_cg"
    )
    epsilon: float = expert(0.01, "[epsilon] stop when a step is shorter than this, rad and m; other solvers: 0.002")
    min_iterations: int = expert(1, "[n_iter] least number of iterations; other solvers: 10")
    max_iterations: int = expert(50, "largest number of iterations; other solvers: 200")


@dataclass
class TrackingConfig:
    """Prediction and the first frame (Section 5.3)."""

    extrapolation: float = expert(0.5, "[alpha] share of the last motion that is added to predict the next pose")
    both_ways: bool = option(
        True,
        "search limbs again in frames all over the clip, and track backwards, too, where limbs are in doubt; needs "
        "outputs.confidence=true",
    )
