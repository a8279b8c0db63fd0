"""Does n_iter matter?

python experiments/min_iterations.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/min_iterations.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("min_iterations")
