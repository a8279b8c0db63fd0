"""What a type checker sees through `import sogjax`; pyright checks this file, nothing runs it."""

from typing import assert_type

import sogjax
from sogjax.io.ground_truth import GroundTruth
from sogjax.quality.evaluation import Evaluation, GroupEvaluation
from sogjax.search.found_pose import FoundPose


def one_actor(path: str) -> None:
    recording = assert_type(sogjax.open_recording(path), sogjax.Recording)
    actor = assert_type(sogjax.make_actor(recording), sogjax.Actor)
    motion = assert_type(sogjax.track(recording, actor, preset="paper"), sogjax.Motion)
    assert_type(sogjax.load_motion(path), sogjax.Motion)
    assert_type(sogjax.load_truth(recording), GroundTruth)
    assert_type(sogjax.evaluate(motion, recording), Evaluation)
    assert_type(sogjax.find_first_pose(recording, actor), FoundPose)
    tracker = assert_type(sogjax.make_tracker(recording, actor), sogjax.Tracker)
    assert_type(tracker.start(), sogjax.TrackState)
    assert_type(sogjax.track_settings(), sogjax.TrackConfig)


def several_actors(recording: sogjax.Recording) -> None:
    actors = [sogjax.load_actor(name) for name in ("human", "dog")]
    motions = assert_type(sogjax.track(recording, actors), list[sogjax.Motion])
    assert_type(sogjax.evaluate(motions, recording), GroupEvaluation)
    assert_type(sogjax.find_first_pose(recording, actors), list[FoundPose])
