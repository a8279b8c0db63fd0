"""`sogjax live`: tracks while pictures arrive, and passes every pose on."""

import sys
import time
from contextlib import closing, redirect_stdout
from pathlib import Path
from typing import Any

from sogjax.io.files import write_json
from sogjax.realtime.json_lines import TERMINAL
from sogjax.realtime.learn_background import learn_place
from sogjax.realtime.session import Session
from sogjax.realtime.start import actors_of, checked, recording_of, session_of
from sogjax.run.run_files import LIVE, MOTION
from sogjax.run.run_folder import free_path
from sogjax.run.terminal import say
from sogjax.settings.live import LiveConfig


def run(config: LiveConfig) -> dict[str, Any]:
    """Track until Ctrl-C, the end of a replay, or for so many seconds; the motion and the figures stay.

    Returns:
        The figures, as `live.json` has them; empty after learning a background.

    Raises:
        InputError: a wrong setting, a camera that does not open, or an address that is not known.
    """
    checked(config)
    recording = recording_of(config)
    if config.learn_background:
        learn_place(recording, config)
        return {}
    actors = actors_of(config)
    out = Path(config.out or f"outputs/{recording.name}_live")
    free_path("out", LIVE.of(out), config.overwrite)
    for actor in actors:
        free_path("out", MOTION.of(out, actor.name, len(actors)), config.overwrite)
    session = session_of(recording, actors, config, out)
    say("live: Ctrl-C ends it and keeps the motion")
    try:
        with closing(session.states()) as states:
            for _ in states:
                pass
    except KeyboardInterrupt:
        say("stopped by Ctrl-C; the motion is kept")
    finally:
        files = finish(session, out)
    report = session.report()
    with redirect_stdout(sys.stderr if config.json == TERMINAL else sys.stdout):  # lines of JSON stay by themselves
        _print(report, files)
    return report


def finish(session: Session, out: Path) -> list[Path]:
    """Write the motion and the figures."""
    files = [] if session.motion is None else session.motion.finish()
    write_json(LIVE.of(out), session.report() | {"ended": time.strftime("%Y-%m-%dT%H:%M:%S%z")})
    return [*files, LIVE.of(out)]


def _print(report: dict[str, Any], files: list[Path]) -> None:
    shown = report["latency_ms"]
    print(
        f"{report['poses']} poses in {report['seconds']:.1f} s ({report['poses_per_second']:.1f} a second); latency "
        f"after arrival {shown['p50']:.0f} ms (p95 {shown['p95']:.0f}, p99 {shown['p99']:.0f}, most {shown['max']:.0f})"
    )
    lost = report["lost"]
    print(f"overwritten {lost['overwritten_sets']}, nobody tracked {lost['unsolved_sets']}, pictures missing: ", end="")
    print(", ".join(f"{name} {count}" for name, count in lost["late_or_missing_pictures"].items()))
    print(*files, sep="\n")
