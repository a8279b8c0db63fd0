"""In which colours should blobs be compared?

python experiments/color_space.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/color_space.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("color_space")
