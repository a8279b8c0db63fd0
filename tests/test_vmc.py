"""VMC: what an avatar in Unity does when it is sent a pose; read by a receiver that shares no code with the sender."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from unity_receiver import Receiver, messages, turned

from sogjax.errors import InputError
from sogjax.model.rotation import world_from_upright
from sogjax.realtime.figures import Stamps
from sogjax.realtime.state import ActorState, LiveState
from sogjax.realtime.vmc import BONES, LARGEST, Avatar, Vmc, packets_of

HUMAN = shipped("human")
PARENTS = {name: above for name, above, _ in BONES}
FRAMES = eqx.filter_jit(lambda body, pose: body.skeleton.world_from_joint(jnp.asarray(pose)))


def body_in(up):
    return HUMAN.rotated(jnp.asarray(world_from_upright(up), jnp.float32))


def pose_of(named="tpose", **values):
    pose = np.array(HUMAN.poses[named], np.float32)
    for name, value in values.items():
        pose[HUMAN.skeleton.dof_names.index(name)] = value
    return pose


def received(pose, up="z", tracked=True):
    """What the receiver makes of a pose of the human in a world with the vertical `up`."""
    body, receiver = body_in(up), Receiver(listens=False)
    joints = np.asarray(FRAMES(body, pose))
    state = ActorState("human", tracked, pose, joints, 0.9, np.zeros(0))
    for packet in packets_of(state, Avatar.of(body, up), 3.5):
        receiver.take(packet)
    return receiver


@pytest.mark.parametrize("up", ["z", "y", "-y", "x"])
def test_an_avatar_in_its_t_pose_looks_forward_with_its_left_on_its_left(up):
    receiver = received(pose_of("tpose"), up)
    world = receiver.world(PARENTS)
    assert receiver.ok == 1
    assert receiver.time == pytest.approx(3.5)
    for bone, (_, turn) in world.items():
        np.testing.assert_allclose(np.abs(turn), [0, 0, 0, 1], atol=1e-6, err_msg=bone)
    assert world["LeftHand"][0][0] < -0.5  # x is to the right
    assert world["RightHand"][0][0] > 0.5
    assert world["Head"][0][1] > world["Hips"][0][1] + 0.5  # y is up


def test_the_left_arm_raised_is_the_left_arm_and_up():
    world = received(pose_of("rest", left_shoulder_raise=2.8)).world(PARENTS)
    shoulder, elbow, hand = (world[f"Left{part}"][0] for part in ("UpperArm", "LowerArm", "Hand"))
    assert hand[1] > elbow[1] + 0.2 > shoulder[1] + 0.4
    right = world["RightHand"][0]
    assert right[1] < world["RightUpperArm"][0][1] - 0.4
    assert hand[0] < 0.0 < right[0]


def test_the_root_moves_the_right_way_and_heights_are_metres():
    height = 0.92
    still = received(pose_of("rest", root_z=height))
    ahead = received(pose_of("rest", root_z=height, root_x=2.0))
    left = received(pose_of("rest", root_z=height, root_y=1.0))
    np.testing.assert_allclose(ahead.root[0] - still.root[0], [0, 0, 2.0], atol=1e-5)  # Unity's forward
    np.testing.assert_allclose(left.root[0] - still.root[0], [-1.0, 0, 0], atol=1e-5)
    assert still.root[0][1] == 0.0  # on the floor
    assert still.world(PARENTS)["Hips"][0][1] == pytest.approx(height, abs=1e-5)


def test_who_turns_left_looks_to_the_left():
    world = received(pose_of("rest", root_yaw=np.pi / 2)).world(PARENTS)  # anticlockwise from above
    np.testing.assert_allclose(turned(world["Head"][1], np.array([0.0, 0.0, 1.0])), [-1.0, 0.0, 0.0], atol=1e-5)


@pytest.mark.parametrize("up", ["z", "y"])
def test_limbs_are_where_the_body_has_them(up):
    """Unity's chain of local turns and offsets leads to the joints that forward kinematics leads to."""
    rng = np.random.default_rng(3)
    lower, upper = (
        np.clip(np.asarray(limit), -2.0, 2.0) for limit in (HUMAN.skeleton.dof_lower, HUMAN.skeleton.dof_upper)
    )
    pose = (0.5 * rng.uniform(lower, upper)).astype(np.float32)
    for k, name in enumerate(HUMAN.skeleton.dof_names):
        if name.startswith("spine") or "forearm" in name or "upper_arm" in name:
            pose[k] = 0.0  # spread over more joints than Unity has
    receiver, body = received(pose, up), body_in(up)
    world, joints = receiver.world(PARENTS), np.asarray(FRAMES(body, pose))
    upright = joints[:, :3, 3] @ world_from_upright(up)
    unity = np.stack([-upright[:, 1], upright[:, 2], upright[:, 0]], axis=-1)
    names = HUMAN.skeleton.names
    ends = {
        "UpperArm": "shoulder_roll",
        "LowerArm": "elbow",
        "Hand": "wrist_bend",
        "LowerLeg": "knee",
        "Foot": "ankle_bend",
    }
    for side in ("Left", "Right"):
        for bone, joint in ends.items():
            place = unity[names.index(f"{side.lower()}_{joint}")]
            np.testing.assert_allclose(world[f"{side}{bone}"][0], place, atol=2e-4, err_msg=f"{side}{bone}")


def test_bones_that_are_not_tracked_are_sent_unturned_and_bundles_are_small():
    receiver = received(pose_of("rest"))
    assert max(receiver.sizes) <= LARGEST < 1500
    assert len(receiver.bones) == 55  # all that Unity has
    np.testing.assert_array_equal(receiver.bones["LeftIndexProximal"][1], [0, 0, 0, 1])


def test_of_somebody_who_is_not_tracked_only_that_is_sent():
    receiver = received(pose_of("rest"), tracked=False)
    assert receiver.ok == 0
    assert not receiver.bones


def test_it_arrives_by_udp():
    receiver = Receiver()
    vmc = Vmc(f"127.0.0.1:{receiver.port}", (HUMAN,), "z")
    joints = np.asarray(FRAMES(HUMAN, pose_of("tpose")))
    actor = ActorState("human", True, pose_of("tpose"), joints, 0.9, np.zeros(0))
    for seconds in (3e6, 3e6 + 0.04):  # the machine has been on for a month: more than OSC's numbers can hold
        vmc.send(LiveState(0, Stamps(*6 * [seconds]), (True,), (actor,)))
    vmc.close()
    receiver.receive(8)
    receiver.close()
    assert receiver.ok == 1
    assert receiver.time == pytest.approx(0.04)
    assert len(receiver.bones) == 55


def test_every_actor_needs_a_port():
    with pytest.raises(InputError, match="2 actors need as many ports"):
        Vmc("127.0.0.1:65535", (HUMAN, HUMAN), "z")


def test_a_dog_is_no_avatar():
    with pytest.raises(InputError, match="human"):
        Avatar.of(shipped("dog"), "z")
    nameless = dataclasses.replace(HUMAN, poses={"rest": HUMAN.poses["rest"]})
    with pytest.raises(InputError, match="tpose"):
        Avatar.of(nameless, "z")


def test_the_receiver_reads_what_another_library_writes():
    from pythonosc.osc_message_builder import OscMessageBuilder

    builder = OscMessageBuilder("/a/b")
    for value in ("name", 1, 0.5):
        builder.add_arg(value)
    assert [*messages(builder.build().dgram)] == [("/a/b", ["name", 1, 0.5])]
