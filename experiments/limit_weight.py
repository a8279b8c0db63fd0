"""Which w_l tracks best?

python experiments/limit_weight.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/limit_weight.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("limit_weight")
