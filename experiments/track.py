"""How does tracking depend on a setting? One run, or a sweep over any settings, which ends with a table.

python experiments/track.py -m energy.limit_weight=0,1,2

tracks the rendered walk of the demo; `recording=FOLDER` tracks another recording.
"""

import sys

from sogjax.app.config.overrides import quoted_value
from sogjax.app.sweep.run import sweep_main, track_task
from sogjax.engine.terminal import progress
from sogjax.synth import SynthSettings, cached_recording

if __name__ == "__main__":
    if not any(word.startswith("recording=") or word in ("-h", "--help") for word in sys.argv[1:]):
        demo = cached_recording(SynthSettings(), progress=progress)
        sys.argv.append(f"recording={quoted_value(str(demo))}")
    sys.exit(sweep_main(track_task))
