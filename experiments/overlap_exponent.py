"""Does the 1/2 that is missing in the printed Eq. 6 matter?

python experiments/overlap_exponent.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/overlap_exponent.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("overlap_exponent")
