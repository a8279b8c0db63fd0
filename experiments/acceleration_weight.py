"""Which w_a tracks best?

python experiments/acceleration_weight.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/acceleration_weight.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("acceleration_weight")
