"""When may the conditioned ascent stop?

python experiments/epsilon.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/epsilon.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("epsilon")
