"""What the pages of the documentation show is true of the program."""

import re
from pathlib import Path

from sogjax.cli.words import composed
from sogjax.io.actor_file import load_body
from sogjax.io.keypoints.scheme import load_scheme, shipped_schemes

GUIDE = Path(__file__).parents[1] / "docs" / "guide"


def test_the_body_of_the_guide_is_one(tmp_path):
    text = (GUIDE / "own_skeleton.md").read_text(encoding="utf-8")
    path = tmp_path / "lamp.yaml"
    path.write_text(re.findall(r"```yaml\n(.*?)```", text, re.S)[0])
    body = load_body(path)
    assert body.name == "lamp"
    assert body.skeleton.dof_names == ("root_x", "root_y", "root_z", "root_yaw", "bow")
    assert set(body.poses) == {"rest", "bowing"}


def test_options_that_the_guide_names_exist():
    pages = [path.read_text(encoding="utf-8") for path in GUIDE.glob("*.md")]
    option = r"`((?:solver|energy|images|color|tracking|outputs)\.?\w*=\w+)`"
    words = {word for page in pages for word in re.findall(option, page)}
    assert words
    for word in words:
        composed("track", ["recording=somewhere", word])


def test_the_scheme_of_the_guide_is_one_and_all_others_are_named(tmp_path):
    text = (GUIDE / "keypoints.md").read_text(encoding="utf-8")
    path = tmp_path / "mine.yaml"
    path.write_text(re.findall(r"```yaml\n(.*?)```", text, re.S)[0])
    assert load_scheme(path).keypoints == ("LKnee", "Head")
    assert all(f"`{name}`" in text and str(scheme.count) in text for name, scheme in shipped_schemes().items())
