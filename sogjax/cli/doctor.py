"""`sogjax doctor`: what is installed, what it runs on, and whether it computes correctly.

The last is told by three laws that hold in a sound installation, checked in about five seconds: an overlap is an
integral, a gradient is a slope, and a body finds its own picture.
"""

import contextlib
import os
import platform
import re
import tempfile
import time
from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.cli.schemas import DoctorConfig
from sogjax.energy.overlap import overlaps
from sogjax.energy.similarity import Similarity
from sogjax.energy.views import Views, whole_image_overlap
from sogjax.errors import InputError
from sogjax.model.camera import Camera, project
from sogjax.model.cores import usable_cores
from sogjax.model.sog import Sog
from sogjax.run.compilation_cache import why_not_kept
from sogjax.run.fingerprint import installed_version
from sogjax.solve.optimistix import OptimistixSolver
from sogjax.solve.solution import Scales

CLASHING = ("opencv-python", "opencv-contrib-python", "opencv-contrib-python-headless")
"""Packages that overwrite opencv-python-headless's files."""
INDIRECT = ("jaxlib", "equinox", "jaxtyping", "scipy")
"""Packages that come with those that are named as needed, and tell most of what may be wrong."""
PROBE_BYTES = 32 * 2**20
SLOW = 20.0
"""MB/s below which a folder is too slow for videos."""
OVERLAP_TOLERANCE, GRADIENT_TOLERANCE = 1e-4, 0.02
"""Relative errors in float32; the second is that of the central difference."""
STEP = 0.004
"""Metres between the middle of a central difference and its ends."""
DISPLACEMENT, BACK = (0.03, -0.02, 0.02), 0.003
"""Metres by which the body is displaced, and those that the solver may end from the true place."""
NUM_BLOBS = 20


def overlap_is_the_integral() -> str | None:
    """Eq. 6 against the sum of the two Gaussians' product over a fine grid."""
    means, sigmas = np.array([[20.0, 22.0], [24.5, 19.0]]), np.array([3.0, 4.0])
    blob = lambda k: Sog.from_arrays(jnp.asarray(means[k : k + 1]), jnp.asarray(sigmas[k : k + 1]), jnp.ones((1, 3)))
    found = float(overlaps(blob(0), blob(1), jnp.ones((1, 1)), jnp.asarray(0.5))[0, 0])
    grid = np.stack(np.meshgrid(np.arange(-20, 60, 0.25), np.arange(-20, 60, 0.25)), axis=-1)
    squares = ((grid[:, :, None] - means) ** 2).sum(axis=-1)
    integral = float(np.exp(-squares / (2.0 * sigmas**2)).prod(axis=-1).sum()) * 0.25**2
    if abs(found - integral) > OVERLAP_TOLERANCE * integral:
        return f"an overlap is {found:.6g}, the integral is {integral:.6g}"
    return None


def gradient_is_the_slope() -> str | None:
    """The closed-form gradient of Eq. 9 by the place of a body against central differences."""
    objective = _objective()
    start = jnp.asarray(DISPLACEMENT)
    value_and_gradient = jax.jit(jax.value_and_grad(objective))
    gradient = np.asarray(value_and_gradient(start)[1], float)
    slope = np.array(
        [
            float(value_and_gradient(start + STEP * e)[0]) - float(value_and_gradient(start - STEP * e)[0])
            for e in jnp.eye(3)
        ]
    ) / (2.0 * STEP)
    error = float(np.linalg.norm(gradient - slope) / np.linalg.norm(slope))
    return f"a gradient is {100 * error:.1f} % off" if not error <= GRADIENT_TOLERANCE else None


def body_finds_its_own_picture() -> str | None:
    """A displaced body climbs back onto its own pictures: nothing resembles a picture more than itself."""
    objective = _objective()
    scales = Scales(jnp.array([0, 0, 0]), jnp.array([0.01]), jnp.array([0.05]))
    solver = OptimistixSolver("lbfgs", epsilon=1e-4, max_iterations=100)
    climb = eqx.filter_jit(lambda start: solver.maximize(objective, start, scales))
    place = np.asarray(climb(jnp.asarray(DISPLACEMENT)).params, float)
    away = float(np.linalg.norm(place))
    return f"a tracking step ends {1000 * away:.1f} mm from the optimum" if not away <= BACK else None


LAWS: dict[str, Callable[[], str | None]] = {
    "overlap": overlap_is_the_integral,
    "gradient": gradient_is_the_slope,
    "tracking step": body_finds_its_own_picture,
}
"""Each returns a complaint, or None if the law holds."""


def _objective() -> Callable[[Float[Array, "3"]], Float[Array, ""]]:
    """Similarity of a body with pictures of itself at the origin, as a function of its displacement.

    The body is as large as a person; each blob has its own colour, so it only fits its own picture.
    """
    rng = np.random.default_rng(0)
    means = rng.uniform([-0.3, -0.3, -0.8], [0.3, 0.3, 0.8], (NUM_BLOBS, 3))
    colors = jnp.asarray(rng.random((NUM_BLOBS, 3)))
    blobs = Sog.from_arrays(jnp.asarray(means), jnp.full(NUM_BLOBS, 0.08), colors)
    cameras = jax.tree.map(lambda *leaves: jnp.stack(leaves), *[_camera(angle) for angle in (0.0, 1.6, 3.5)])

    def own_views(cameras: Camera, blobs: Sog) -> Views:
        images = jax.vmap(project, in_axes=(0, None))(cameras, blobs)
        normalizers = whole_image_overlap(cameras.image_size)
        return Views.from_images(cameras, images, blobs, normalizers, "rgb", jnp.asarray(0.3))

    views, similarity = eqx.filter_jit(own_views)(cameras, blobs), Similarity(1.0, capped=False)

    def objective(shift: Float[Array, "3"]) -> Float[Array, ""]:
        moved = eqx.tree_at(lambda sog: sog.means, blobs, blobs.means + shift[None, :])
        return similarity.of_blobs(moved, views)

    return objective


def _camera(angle: float) -> Camera:
    """A camera 3 m from the origin that looks at it."""
    forward = -np.array([np.cos(angle), np.sin(angle), 0.0])
    down = np.array([0.0, 0.0, -1.0])
    pose = np.eye(4)
    pose[:3, :3] = np.stack([np.cross(down, forward), down, forward])
    pose[2, 3] = 3.0
    matrix = np.array([[500.0, 0.0, 319.5], [0.0, 500.0, 239.5], [0.0, 0.0, 1.0]])
    return Camera(jnp.asarray(matrix), jnp.asarray(pose), jnp.zeros(5), jnp.asarray([640.0, 480.0]))


def run(config: DoctorConfig) -> None:
    """Print what is installed, and test it.

    Raises:
        InputError: something that sogjax needs is missing, clashes or computes wrong results, as printed before.
    """
    troubles = [*_packages()]
    _say_machine()
    say_programs(jax.config.values["jax_compilation_cache_dir"])
    _say_extras()
    for folder in dict.fromkeys([Path(config.folder), Path(tempfile.gettempdir())]):
        troubles += _write_speed(folder)
    troubles += [trouble for name, law in LAWS.items() for trouble in _tested(name, law)]
    if troubles:
        raise InputError(f"{len(troubles)} found: {'; '.join(troubles)}")
    print("everything works")


def _line(what: str, value: str) -> None:
    print(f"{what:<28} {value}", flush=True)


def _packages() -> Iterator[str]:
    _line("python", f"{platform.python_version()} ({platform.system()} {platform.machine()})")
    for name in ("sogjax", *_named_packages().get("", ()), *INDIRECT):
        found = installed_version(name)
        _line(name, found or "missing")
        if found is None:
            yield f"{name} is missing; install sogjax again with pip"
    for name in CLASHING:
        if installed_version(name) is not None:
            _line(name, f"{installed_version(name)}, overwrites opencv-python-headless")
            yield f"{name} is installed over opencv-python-headless; uninstall both, then install the latter"


def _say_machine() -> None:
    """Print what jax computes on."""
    devices = jax.devices()
    _line("devices", ", ".join(f"{device.platform} {device.device_kind}" for device in devices))
    _line("processor cores", str(usable_cores()))


def say_programs(folder: str | None) -> None:
    """Print how many compiled programs are kept in a folder, or why none are where there is none."""
    if folder is None:
        _line("compiled programs", f"are not kept ({why_not_kept()})")
        return
    files = [path for path in Path(folder).glob("*-cache") if path.is_file()]
    size = sum(path.stat().st_size for path in files) / 1e6
    _line("compiled programs", f"{len(files)} in {folder} ({size:.1f} MB)")


def _say_extras() -> None:
    """Print which extras are there; tracking alone needs none."""
    for extra, packages in sorted(_named_packages().items()):
        missing = [name for name in packages if installed_version(name) is None]
        remedy = f"without {', '.join(missing)}; pip install 'sogjax[{extra}]' adds it"
        if extra:
            _line(f"extra [{extra}]", remedy if missing else "there")


def _named_packages() -> dict[str, list[str]]:
    """The packages that the installation says it needs, by the extra that needs them; without a name by all."""
    found: dict[str, list[str]] = {}
    with contextlib.suppress(PackageNotFoundError):
        for line in requires("sogjax") or ():
            extra = line.partition("extra == ")[2].strip("'\"")
            found.setdefault(extra, []).append(re.findall(r"[\w.-]+", line)[0])
    return found


def _write_speed(folder: Path) -> Iterator[str]:
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            begin = time.monotonic()
            file.write(os.urandom(2**20) * (PROBE_BYTES // 2**20))
            file.flush()
            os.fsync(file.fileno())
            speed = PROBE_BYTES / 1e6 / (time.monotonic() - begin)
    except OSError as error:
        _line(f"writing to {folder}", f"fails ({error.strerror})")
        yield f"{folder} cannot be written ({error.strerror}); work in another folder"
        return
    _line(f"writing to {folder}", f"{speed:.0f} MB/s" + (", slow: results will wait for it" if speed < SLOW else ""))


def _tested(name: str, law: Callable[[], str | None]) -> Iterator[str]:
    """Check a law; its complaint, or an error on the way, is a problem."""
    begin = time.monotonic()
    try:
        complaint = law()
    except Exception as error:  # whatever is broken in an installation shall be said, not end the looking
        complaint = f"{type(error).__name__}: {str(error).splitlines()[0] if str(error) else 'no message'}"
    _line(f"test: {name}", f"{'right' if complaint is None else 'WRONG'} ({time.monotonic() - begin:.1f} s)")
    if complaint is not None:
        yield f"{name}: {complaint}; this machine or its libraries compute wrong results; install sogjax again"
