"""How fast is it by stage, with how many cameras and actors?

python experiments/throughput.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/throughput.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("throughput")
