"""How many cameras are needed?

python experiments/cameras.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/cameras.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("cameras")
