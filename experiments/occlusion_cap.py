"""What does the cap against blobs that hide each other do?

python experiments/occlusion_cap.py [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

The settings that are compared stand in conf/experiment/occlusion_cap.yaml.
"""

from sogjax.study.command import study_main

if __name__ == "__main__":
    study_main("occlusion_cap")
