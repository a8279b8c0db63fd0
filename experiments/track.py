"""How does tracking depend on a setting? One run, or a sweep over any settings, which ends with a table.

python experiments/track.py recording=FOLDER -m energy.limit_weight=0,1,2
"""

import sys

from sogjax.app.sweep import sweep_main, track_task

if __name__ == "__main__":
    sys.exit(sweep_main(track_task))
