"""What does the gradient cost? Value alone against value and gradient, by the closed form and by plain autodiff.

python benchmarks/gradient.py [cameras=12] [image_blobs=1024] [repeats=40]

The body is the default one (63 blobs); the image blobs are cells about it. All in float32, warm, in turn.
"""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from sogjax.energy.frame_energy import FrameEnergy, standard_terms
from sogjax.energy.overlap import GradientMode
from sogjax.energy.posed import History
from sogjax.energy.similarity import Similarity
from sogjax.energy.views import Views, whole_image_overlap
from sogjax.io.actor_file import load_body, named_body
from sogjax.model.body import Body
from sogjax.model.camera import Camera, project
from sogjax.model.sog import Sog
from sogjax.study.script import machine_line, settings_from

ROW = "{:<34}{:>12}{:>12}{:>24}"


@dataclass
class Settings:
    """Sizes, as `key=value` on the command line."""

    cameras: int = 12
    image_blobs: int = 1024
    repeats: int = 40


def main() -> None:
    """Print the table."""
    settings = settings_from(Settings)
    body = load_body(named_body("human"))
    pose = body.poses["rest"]
    views = scattered_views(body, settings)
    print(f"{settings.cameras} cameras x {settings.image_blobs} x {body.num_blobs} blobs, float32")
    print(machine_line(), end="\n\n")
    print(ROW.format("", "median ms", "ratio", "largest difference"))
    compare("overlap, by the blobs", settings.repeats, overlap_of(views), body.posed_blobs(pose))
    compare("energy, by the pose", settings.repeats, energy_of(body, views), pose)


def overlap_of(views: Views) -> Callable[[GradientMode], Callable]:
    """Eq. 9 as a function of the means of the blobs in the world."""

    def function(gradient: GradientMode) -> Callable:
        similarity = Similarity(1.0, gradient=gradient)
        return lambda blobs: similarity.of_blobs(blobs, views)

    return function


def energy_of(body: Body, views: Views) -> Callable[[GradientMode], Callable]:
    """Eq. 10 as a function of the pose."""

    def function(gradient: GradientMode) -> Callable:
        history = History(body.poses["rest"], body.poses["rest"], jnp.asarray(True))
        objective = FrameEnergy(body, views, history, standard_terms(gradient=gradient))
        return lambda pose: objective(pose)

    return function


def compare(title: str, repeats: int, function_for: Callable[[GradientMode], Callable], argument: object) -> None:
    """Rows of the value alone, and of value and gradient in both ways."""
    gradient_of = partial(jax.value_and_grad, allow_int=True)
    calls = {
        "value": jax.jit(function_for("forward")),
        "value and gradient, forward": jax.jit(gradient_of(function_for("forward"))),
        "value and gradient, autodiff": jax.jit(gradient_of(function_for("autodiff"))),
    }
    results = {name: jax.block_until_ready(call(argument)) for name, call in calls.items()}
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(repeats):
        for name, call in calls.items():
            begin = time.perf_counter()
            jax.block_until_ready(call(argument))
            seconds[name].append(time.perf_counter() - begin)
    print(title)
    alone = statistics.median(seconds["value"])
    reference = flat(results["value and gradient, autodiff"][1])
    for name in calls:
        median = statistics.median(seconds[name])
        difference = ""
        if "gradient" in name:
            error = np.abs(flat(results[name][1]) - reference).max() / np.abs(reference).max()
            difference = f"{error:.1e} of the largest" if "forward" in name else "reference"
        print(ROW.format(f"  {name}", f"{1000 * median:.2f}", f"{median / alone:.2f}", difference))


def flat(gradient: object) -> np.ndarray:
    """The parts of a gradient by means and sigmas, or by the pose, as one vector."""
    leaves = [gradient.means, gradient.sigmas] if isinstance(gradient, Sog) else [gradient]
    return np.concatenate([np.asarray(leaf, float).ravel() for leaf in leaves])


def scattered_views(body: Body, settings: Settings) -> Views:
    """A ring of cameras whose image blobs are the cells nearest to the projected body, in the order of a picture.

    Cells are as large as lets their number cover the body and its surroundings. Body and picture wear three clothes,
    each of which is alike in itself only.
    """
    rng = np.random.default_rng(0)
    cameras = ring(settings.cameras)
    rest = body.poses["rest"]
    seen = jax.vmap(project, in_axes=(0, None))(cameras, body.posed_blobs(rest))
    side = 8.0 * np.sqrt(1024.0 / settings.image_blobs)
    x, y = np.meshgrid(np.arange(side / 2, 1296.0, side), np.arange(side / 2, 972.0, side))
    cells = np.stack([x.ravel(), y.ravel()], axis=-1)
    means, worn = [], []
    for of_camera, sigmas in zip(np.asarray(seen.means, float), np.asarray(seen.sigmas, float), strict=True):
        far = np.linalg.norm(cells[:, None, :] - of_camera[None], axis=-1) / sigmas
        nearest = np.sort(np.argsort(far.min(axis=1), kind="stable")[: settings.image_blobs])
        means.append(cells[nearest])
        worn.append(far[nearest].argmin(axis=1))
    shape = (settings.cameras, settings.image_blobs)
    clothes = lambda blobs: 0.5 * (3 * blobs // body.num_blobs)
    lightness = clothes(np.stack(worn)) + rng.uniform(0.0, 0.25, shape)
    images = Sog(
        means=jnp.asarray(np.stack(means), jnp.float32),
        sigmas=jnp.full(shape, side / 2, jnp.float32),
        colors=along_lightness(lightness),
        mask=jnp.ones(shape, bool),
    )
    wearing = replace(body.posed_blobs(rest), colors=along_lightness(clothes(np.arange(body.num_blobs))))
    normalizers = whole_image_overlap(cameras.image_size)
    return Views.from_images(cameras, images, wearing, normalizers, "lab", jnp.asarray(0.25))


def along_lightness(lightness: np.ndarray) -> jax.Array:
    """Greys, in Lab / 100."""
    return jnp.asarray(np.stack([lightness, 0.0 * lightness, 0.0 * lightness], axis=-1), jnp.float32)


def ring(count: int) -> Camera:
    """Cameras in a ring of 4 m that look at the body's root from 1 m above it, 1296 x 972 pixels."""
    poses = []
    for angle in np.arange(count) * 2.0 * np.pi / count:
        centre = np.array([4.0 * np.cos(angle), 4.0 * np.sin(angle), 1.0])
        forward = -centre / np.linalg.norm(centre)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        poses.append(np.block([[rotation, -(rotation @ centre)[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]]))
    matrix = np.array([[1100.0, 0.0, 647.5], [0.0, 1100.0, 485.5], [0.0, 0.0, 1.0]])
    return Camera(
        intrinsics=jnp.asarray(np.tile(matrix, (count, 1, 1)), jnp.float32),
        camera_from_world=jnp.asarray(np.stack(poses), jnp.float32),
        distortion=jnp.zeros((count, 5), jnp.float32),
        image_size=jnp.asarray(np.tile([1296.0, 972.0], (count, 1)), jnp.float32),
    )


if __name__ == "__main__":
    main()
