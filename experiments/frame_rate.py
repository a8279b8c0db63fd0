"""How many frames a second are needed?

python experiments/frame_rate.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/frame_rate.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("frame_rate")
