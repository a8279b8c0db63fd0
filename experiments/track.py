"""How does tracking depend on a setting? One run, or a sweep over any settings, which ends with a table.

python experiments/track.py -m energy.limit_weight=0,1,2

tracks the rendered walk of the demo; `recording=FOLDER` tracks another recording. It is `sogjax track` otherwise.
"""

import sys

from sogjax.cli.main import main
from sogjax.cli.words import quoted_value
from sogjax.run.terminal import progress
from sogjax.synth.cache import cached_recording
from sogjax.synth.settings import SynthSettings

if __name__ == "__main__":
    words = sys.argv[1:]
    if not any(word.startswith("recording=") or word in ("-h", "--help") for word in words):
        words.append(f"recording={quoted_value(str(cached_recording(SynthSettings(), progress=progress)))}")
    sys.exit(main(["track", *words]))
