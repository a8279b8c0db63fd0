"""How does tracking depend on a setting? One run, or a sweep over any settings, which ends with a table.

python experiments/track.py -m energy.limit_weight=0,1,2

tracks the rendered walk of the demo; `recording=FOLDER` tracks another recording.
"""

import sys

from sogjax.app.script import demo_recording_unless_given
from sogjax.app.sweep import sweep_main, track_task

if __name__ == "__main__":
    demo_recording_unless_given()
    sys.exit(sweep_main(track_task))
