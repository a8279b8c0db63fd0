"""How fine must the quad-tree be where colours change?

python experiments/color_tolerance.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/color_tolerance.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("color_tolerance")
