"""What does tracking a frame cost on every device that jax has, alone and many times in one call; is it the same there?

    python benchmarks/devices.py [recording=FOLDER] [starts=64] [members=64] [repeats=10]

On the first frame of a recording (the demo's, rendered now if it is not there yet): a step as `sogjax track` makes it;
so many first poses moved by up to 2 cm and 2 degrees, climbed in one call, as a search does; so many members of a sweep
over w_l, w_a and epsilon in one call. The poses of every device are held against those of the CPU: their energies, and
the means of the blobs.
"""

import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from runs import FirstStep, Scene, first_step
from track_speed import demo_recording

from sogjax.model.body import Body
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.tracking.frame import FrameInput, TrackState
from sogjax.tracking.tracker import Tracker

MOVED = 0.02, np.deg2rad(2.0)
"""Metres and radians by which starts differ at most."""
MEMBERS = np.geomspace(0.25, 4.0, 64)
"""Factors of what a sweep varies."""
TITLES = "device", "", "first call, s", "ms a call", "poses a second", "blobs apart, mm", "energy, relative"
ROW = "{:<14}{:<38}{:>14}{:>12}{:>16}{:>17}{:>18}"


@dataclass
class Settings:
    """What is measured, as `key=value` on the command line."""

    recording: str | None = None
    starts: int = 64
    members: int = 64
    repeats: int = 10


class Found(NamedTuple):
    """Poses that one call found."""

    poses: Float[np.ndarray, "case dof"]
    energies: Float[np.ndarray, "case"]


class Case(NamedTuple):
    """One compiled call, and how many poses it finds."""

    name: str
    poses: int
    call: Callable[[FirstStep], tuple[Float[Array, "case dof"], Float[Array, "case"]]]


def main() -> None:
    """Print a row for each device and call."""
    settings = settings_from(Settings)
    folder = demo_recording() if settings.recording is None else Path(settings.recording)
    scene = Scene.of(folder, 2)
    first = first_step(scene)
    names = scene.recording.rig.names
    width, height = scene.recording.rig.image_size(names[0])
    devices = available()
    print(machine_line())
    print(f"devices: {', '.join(map(title, devices))}; {len(names)} cameras, {width}x{height}\n")
    print(
        ROW.format(*TITLES),
        flush=True,
    )
    known: dict[str, Found] = {}
    for device in devices:
        for case in cases(first, settings):
            found, begun, milli = measured(case, first, device, settings.repeats)
            reference = known.setdefault(case.name, found)
            apart, relative = differences(first.tracker.body, reference, found)
            rate = 1000.0 * case.poses / milli
            values = f"{begun:.1f}", f"{milli:.2f}", f"{rate:.1f}", f"{1000.0 * apart:.3f}", f"{relative:.1e}"
            print(ROW.format(title(device), case.name, *values), flush=True)


def available() -> list[Any]:
    """One CPU, and every device of the kind that jax prefers."""
    cpus = jax.devices("cpu")[:1]
    return cpus + [device for device in jax.devices() if device.platform != "cpu"]


def title(device: Any) -> str:
    """A device's name in the table."""
    return "CPU" if device.platform == "cpu" else device.device_kind


def cases(first: FirstStep, settings: Settings) -> Iterator[Case]:
    """The calls that are measured."""
    starts = jnp.asarray(moved(first, settings.starts))
    factors = jnp.asarray(np.resize(MEMBERS, settings.members), jnp.float32)

    def step(first: FirstStep) -> tuple[Array, Array]:
        _, result = first.tracker.step(first.state, FrameInput(first.cells), first.capacities)
        return result.pose[None], result.energy[None]

    def climbs(first: FirstStep, starts: Array) -> tuple[Array, Array]:
        seen = first.tracker.views(FrameInput(first.cells), first.state, first.capacities)
        of_pose = lambda pose: first.tracker.found(TrackState.from_pose(pose), seen, first.capacities)[1]
        found = jax.vmap(of_pose)(starts)
        return found.pose, found.energy

    def sweep(first: FirstStep, factors: Array) -> tuple[Array, Array]:
        def of_member(factor: Array) -> Any:
            tracker = varied(first.tracker, factor)
            return tracker.step(first.state, FrameInput(first.cells), first.capacities)[1]

        found = jax.vmap(of_member)(factors)
        return found.pose, found.energy

    yield Case("a step", 1, eqx.filter_jit(step))
    yield Case(f"{settings.starts} starts in one call", settings.starts, with_more(climbs, starts))
    yield Case(f"{settings.members} members of a sweep in one call", settings.members, with_more(sweep, factors))


def with_more(function: Callable, more: Array) -> Callable:
    """A compiled call with one more argument, which is put where the others are."""
    compiled = eqx.filter_jit(function)
    return lambda first: compiled(first, jax.device_put(more, first.cells.device))


def varied(tracker: Tracker, factor: Float[Array, ""]) -> Tracker:
    """The tracker with w_l, w_a and the range of colours epsilon multiplied."""
    weights = lambda t: [term.weight for term in t.terms[1:]] + [t.reader.color_radius]
    return eqx.tree_at(weights, tracker, [weight * factor for weight in weights(tracker)])


def moved(first: FirstStep, count: int) -> Float[np.ndarray, "case dof"]:
    """Poses about the first one, the same ones every time; the first is that itself."""
    pose, slides = np.asarray(first.state.previous), np.asarray(first.tracker.scales.kinds) % 2 == 1
    bounds = np.where(slides, *MOVED)
    off = np.random.default_rng(0).uniform(-bounds, bounds, (count, pose.size))
    off[0] = 0.0
    return (pose + off).astype(np.float32)


def measured(case: Case, first: FirstStep, device: Any, repeats: int) -> tuple[Found, float, float]:
    """What a call finds on a device, the seconds of the first one, which compiles, and the median milliseconds of more.

    The result is brought back in each.
    """
    arrays, others = eqx.partition(first, eqx.is_array)
    there = eqx.combine(jax.device_put(arrays, device), others)

    def timed() -> tuple[Found, float]:
        begin = time.perf_counter()
        found = Found(*jax.device_get(case.call(there)))
        return found, time.perf_counter() - begin

    with jax.default_device(device):
        found, begun = timed()
        return found, begun, 1000.0 * statistics.median(timed()[1] for _ in range(repeats))


def differences(body: Body, expected: Found, found: Found) -> tuple[float, float]:
    """The largest of the mean distances of the blobs (metres), and of the relative differences of the energies."""
    with jax.default_device(jax.devices("cpu")[0]):
        means = jax.vmap(lambda pose: body.posed_blobs(pose).means)
        apart = np.linalg.norm(np.asarray(means(found.poses) - means(expected.poses)), axis=-1).mean(-1)
    relative = np.abs(found.energies / expected.energies - 1.0)
    return float(apart.max()), float(relative.max())


if __name__ == "__main__":
    run_script(main)
