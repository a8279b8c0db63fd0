"""How deep must the quad-tree be?

python experiments/depth.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/depth.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("depth")
