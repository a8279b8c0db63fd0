"""A process that films with some of the cameras: `python -m sogjax.synth.worker`, its order on standard input.

A process of its own, and not one of `multiprocessing`: it works from notebooks, from scripts without a main
guard and inside pytest alike. It writes a line for every picture it has made.
"""

import json
import sys
from pathlib import Path

from sogjax.errors import InputError
from sogjax.synth.filming import film
from sogjax.synth.settings import SynthSettings
from sogjax.synth.stage import stage_of


def main() -> None:
    """Read the order (settings, cameras, folder) as JSON, film, report every picture."""
    order = json.load(sys.stdin)
    stage = stage_of(SynthSettings(**order["settings"]))
    try:
        for _ in film(stage, order["cameras"], Path(order["folder"])):
            print("picture", flush=True)
    except InputError as error:  # a full disk
        print("refused", " ".join(str(error).split()), flush=True)


if __name__ == "__main__":
    main()
