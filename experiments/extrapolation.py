"""How much of the last motion should be added to predict the next pose?

python experiments/extrapolation.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/extrapolation.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("extrapolation")
