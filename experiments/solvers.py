"""Which solver is the most accurate for its time, and how many iterations does each need?

python experiments/solvers.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/solvers.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("solvers")
