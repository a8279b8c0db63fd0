"""What the timeline of a page marks: limbs that too few cameras see, and those that another pass found."""

from dataclasses import replace

import numpy as np
import pytest
from body_cases import shipped
from rig_cases import ring_rig
from run_cases import DOG, stand_in_tracked, tiny_run

from sogjax.io.frame_table import FramesRecord
from sogjax.io.motion import motion_from_poses
from sogjax.model.limbs import joint_limbs, limb_names, limbs
from sogjax.quality.limb_warnings import in_doubt
from sogjax.quality.verdict import verdicts
from sogjax.run.page import revised_limbs
from sogjax.view.page.run_page import ActorOnPage, _of_actor, _why
from sogjax.view.page.sight import hidden_limbs
from sogjax.view.page.timeline import Marks, confidence_colors, timeline

HUMAN = shipped("human")
NAMES = limb_names(HUMAN)


def standing(x=0.0, y=0.0, frames=3):
    """Somebody who stands with the arms out, judged to be in place."""
    pose = np.array(HUMAN.poses["rest"])
    dofs = list(HUMAN.skeleton.dof_names)
    pose[dofs.index("root_x")], pose[dofs.index("root_y")], pose[dofs.index("root_z")] = x, y, 0.9
    poses = np.tile(pose, (frames, 1)).astype(np.float32)
    doubt = np.full((frames, len(NAMES)), 0.05)
    return motion_from_poses(
        HUMAN, poses, 25.0, limb_names=NAMES, joint_limb=joint_limbs(HUMAN.skeleton), limb_doubt=doubt
    )


def test_limbs_outside_of_the_pictures_are_hidden():
    rig = ring_rig(4)
    inside, outside = hidden_limbs(rig, [standing(), standing(x=40.0)])
    assert inside.shape == outside.shape == (3, len(NAMES))
    assert not inside.any()
    assert outside.all()


def test_a_person_hides_who_stands_behind():
    """Before a single camera, which then must see a limb."""
    rig = ring_rig(1)
    centre = np.linalg.inv(np.asarray(rig.cameras.camera_from_world, float)[0])[:3, 3]
    towards = centre[:2] / np.linalg.norm(centre[:2])
    nearer = standing(*(0.6 * towards).tolist())
    alone, before = hidden_limbs(rig, [standing()])[0], hidden_limbs(rig, [nearer, standing()])
    assert before[1].sum() > alone.sum() + 3
    np.testing.assert_array_equal(before[0], hidden_limbs(rig, [nearer])[0])


def test_limbs_that_another_pass_moved_are_revised():
    run = tiny_run()
    tracked = stand_in_tracked(run)
    pose, (first, *_) = tracked.table.pose[3].copy(), limbs(DOG.skeleton)
    pose[first[0]] += 0.2
    run.records |= {"tracked": tracked}
    assert revised_limbs(run, [DOG]) == [None]
    run.records |= {"merged": FramesRecord(tracked.table.with_rows([3], [{"pose": pose}]))}
    (found,) = revised_limbs(run, [DOG])
    assert found is not None
    assert np.argwhere(found).tolist() == [[3, 0]]


@pytest.mark.slow
def test_marked_stretches_are_drawn():
    motion = standing(frames=20)
    marked = np.zeros((20, len(NAMES)), bool)
    none = np.zeros_like(marked)
    marked[5:9, 1] = True
    plain, hidden, revised = (
        timeline(motion, marks, None) for marks in (Marks(none, none), Marks(marked, none), Marks(none, marked))
    )
    assert "<pattern" not in plain
    assert hidden.count("<pattern") == 2  # of a large and a small screen
    assert "<pattern" not in revised
    assert revised.count("<path") == plain.count("<path") + 2
    assert 'aria-label="Timeline of frames 0 to 19' in plain


def test_colours_tell_lost_limbs_from_sure_ones():
    lost, half, sure = confidence_colors(np.array([0.0, 0.5, 1.0]))
    assert lost[0] > lost[1] + 0.5
    assert half[0] > half[2] + 0.5
    assert sure[1] > sure[0] + 0.2


def test_the_page_names_the_limbs_that_the_verdict_names():
    doubt = np.full((6, len(NAMES)), 0.05)
    doubt[:, 1], doubt[:, 2] = 0.45, 0.3
    motion = replace(standing(frames=6), limb_doubt=doubt)
    verdict = verdicts({"anna": motion}, {})["anna"]
    actor = ActorOnPage(motion, HUMAN, verdict, None)
    assert [limb.name for limb in verdict.doubtful] == [NAMES[1]]
    assert _why(actor, 3, several=False) == f"{NAMES[1]} 55% sure"
    assert np.array_equal(np.array(_of_actor(actor)["doubted"], bool), in_doubt(motion).T)
    assert in_doubt(motion).any(axis=0).tolist() == [k == 1 for k in range(len(NAMES))]
