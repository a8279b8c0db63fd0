"""What is the answer to one of the study's questions?

python experiments/study.py NAME [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

Runs the experiment of `conf/experiment/NAME.yaml`, or of any file like those, and prints its tables.
"""

import sys

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main(sys.argv[1:])
