"""How few Gaussians a picture are enough?

python experiments/resolution.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/resolution.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("resolution")
