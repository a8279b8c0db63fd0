"""How unlike may colours be that still match?

python experiments/color_radius.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/color_radius.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("color_radius")
