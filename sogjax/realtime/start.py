"""From settings to a session: the cameras, the actors, what is known of the place, and who is told."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sogjax.energy.term import Term
from sogjax.errors import InputError
from sogjax.io.frame_motions import ClipFacts
from sogjax.io.recording import Recording, open_place
from sogjax.io.recording_files import IMAGES, SYNCHRONIZED, VIDEOS
from sogjax.io.source import videos_in
from sogjax.io.video import read_still
from sogjax.model.body import Body
from sogjax.realtime.addresses import Address
from sogjax.realtime.following import Following
from sogjax.realtime.json_lines import TERMINAL, JsonLines, Publisher, address_of
from sogjax.realtime.lab_stream import LabStream
from sogjax.realtime.opened_camera import OpenedCamera, checked_sources
from sogjax.realtime.recorder import MotionRecorder, VideoRecorder
from sogjax.realtime.replay import faults_of, replay_cameras
from sogjax.realtime.rerun_live import RerunLive
from sogjax.realtime.searching import SearchBeside
from sogjax.realtime.session import Publishers, Session
from sogjax.realtime.stepping import LiveStep
from sogjax.realtime.urgency import SEARCH, yield_to_others
from sogjax.realtime.vmc import PORT as VMC_PORT
from sogjax.realtime.vmc import Vmc
from sogjax.realtime.warm_up import drawn_frame, standing, warm_up, warm_up_step
from sogjax.run import build
from sogjax.run.actors import Actors
from sogjax.run.background import Background, learn_background
from sogjax.run.clip import Clip
from sogjax.run.clip_search import ClipSearch
from sogjax.run.passes import PASSES
from sogjax.run.recordings import body_named, file_list, opened, with_cameras
from sogjax.run.run import Run
from sogjax.run.runner import run_passes
from sogjax.run.setup import Setup, tracking_setup
from sogjax.run.terminal import say
from sogjax.scene.background import BackgroundImage
from sogjax.scene.background_difference import working_size
from sogjax.settings.live import LiveConfig
from sogjax.settings.run import TrackConfig

USUAL_RATE = 30.0
"""Pictures per second of cameras of which nothing is known."""
UP_TO_TRACKING = PASSES[: [each.name for each in PASSES].index("tracked")]
"""The passes of a replay before it begins: its place is then as well known as to a run over the recording."""
FROM_THE_POSE = ("initial_pose", "relearnt", "remade", "keypoint_bias")
"""Those of them that need a first pose."""


def checked(config: LiveConfig) -> None:
    """Check the settings before any work begins.

    Raises:
        InputError: a value out of range, or settings that exclude each other.
    """
    build.check(track_settings_of(config))
    build.at_least("wait", config.wait, 0.0)
    build.at_least("iterations", config.iterations, 1)
    build.at_least("speed", config.speed, 0.01)
    if config.seconds is not None:
        build.at_least("seconds", config.seconds, 0.0)
    if config.fps is not None:
        build.at_least("fps", config.fps, 1.0)
    if config.replay and config.sources:
        raise InputError("replay=true sources=...: exclude each other; leave one of them out")
    if config.learn_background and config.replay:
        raise InputError("learn_background=true: needs cameras (sources=), a recording learns its own")
    if config.vmc is not None:
        Address.of("vmc", config.vmc, VMC_PORT)
    if config.json not in (None, TERMINAL):
        address_of(config.json)


def track_settings_of(config: LiveConfig) -> TrackConfig:
    """The settings of a track that a live session shares with one."""
    shared = {key: getattr(config, key) for key in ("color", "images", "energy", "tracking", "cameras")}
    solver = replace(config.solver, max_iterations=min(config.solver.max_iterations, config.iterations))
    return TrackConfig(recording=config.recording, actor=config.actor, solver=solver, **shared)


def recording_of(config: LiveConfig) -> Recording:
    """The recording that is replayed, or the place before the cameras.

    Raises:
        InputError: something is missing or wrong.
    """
    path = Path(config.recording)
    has_videos = bool(videos_in(VIDEOS.of(path)) or videos_in(SYNCHRONIZED.of(path)) or IMAGES.of(path).is_dir())
    if config.replay or has_videos:
        recording = opened(config.recording, config.cameras)
    else:
        recording = with_cameras(open_place(path), config.cameras)
    if config.replay:
        return recording
    sources = checked_sources(config.sources, recording.rig.names)
    used = tuple(name for name in recording.rig.names if name in sources)
    rate = config.fps or recording.fps or USUAL_RATE
    return replace(with_cameras(recording, used), fps=rate)


def actors_of(config: LiveConfig) -> list[Body]:
    """The actors of files.

    Raises:
        InputError: none is named, or a file cannot be read.
    """
    if config.actor is None:
        raise InputError(
            "actor=null: live tracking needs an actor; make one from a recording of the same person and cameras: "
            "sogjax actor recording=FOLDER out=actor.yaml"
        )
    return [body_named(str(path)) for path in file_list(config.actor)]


def session_of(
    recording: Recording, actors: Sequence[Body], config: LiveConfig, out: Path | None, terms: Sequence[Term] = ()
) -> Session:
    """The session that the settings ask for; the cameras are open, and the tracker is compiled.

    Raises:
        InputError: a camera that does not open, an address that is not known, or no initial pose of a replay.
    """
    faults_of(config.faults, recording.rig.names)
    rate = recording.fps * (config.speed if config.replay else 1.0)
    videos = None if config.record is None else VideoRecorder(Path(config.record), recording, rate)
    session = (_replayed if config.replay else _from_cameras)(recording, actors, config, terms)
    session.wait, session.seconds, session.videos = config.wait, config.seconds, videos
    if out is not None:
        facts = ClipFacts(1.0 / session.period, recording.up, recording.rig.names)
        session.motion = MotionRecorder(out, session.setup.bodies, facts)
    return session


def _replayed(recording: Recording, actors: Sequence[Body], config: LiveConfig, terms: Sequence[Term]) -> Session:
    settings = track_settings_of(config)
    clip = Clip(recording, recording.frames, config.images.depth)
    run = Run(clip, settings, terms=terms, takes_steps=False, records={"actors": Actors(tuple(actors))})
    run_passes(run, [each for each in UP_TO_TRACKING if not config.search or each.name not in FROM_THE_POSE])
    pose = None if config.search else np.asarray(run.initial_pose.pose)
    first = recording.first_frame if config.search else run.initial_pose.frame
    period = 1.0 / (recording.fps * config.speed)
    publishers = publishers_of(run.setup, config, period)
    cameras, pace = replay_cameras(recording, config.faults, first, config.speed, config.loop)
    following = _following(run.setup, run.background, settings, terms, pose, period)
    seen = next(clip.frames(first, first + 1))
    if config.search:
        warm_up(following, drawn_frame(run.setup, run.background), standing(run.setup))
    else:
        warm_up_step(following, seen, run.initial_pose.pose)
    return Session(run.setup, cameras, following, period, first, pace=pace, publishers=publishers)


def _from_cameras(recording: Recording, actors: Sequence[Body], config: LiveConfig, terms: Sequence[Term]) -> Session:
    settings = track_settings_of(config)
    cameras = opened_cameras(recording, config.sources)
    try:
        background = background_of(recording, config)
        setup = tracking_setup(Clip(recording, range(0), config.images.depth), background, actors, settings, terms)
        publishers = publishers_of(setup, config, 1.0 / recording.fps)
        following = _following(setup, background, settings, terms, None, 1.0 / recording.fps)
        warm_up(following, drawn_frame(setup, background), standing(setup))
    except BaseException:
        for camera in cameras:
            camera.release()
        raise
    return Session(setup, cameras, following, 1.0 / recording.fps, publishers=publishers)


def opened_cameras(recording: Recording, sources: Any) -> list[OpenedCamera]:
    """The cameras of a recording, opened.

    Raises:
        InputError: one does not open, or its pictures are of another size.
    """
    found, cameras = checked_sources(sources, recording.rig.names), list[OpenedCamera]()
    try:
        for name in recording.rig.names:
            cameras.append(OpenedCamera(name, found[name], recording.rig.image_size(name)))
    except InputError:
        for camera in cameras:
            camera.release()
        raise
    return cameras


def background_of(recording: Recording, config: LiveConfig) -> Background:
    """What is known of the place: from its videos, where it has some, else from pictures of it.

    Raises:
        InputError: it is asked for and there is none.
    """
    if recording.sources:
        clip = Clip(recording, recording.frames, config.images.depth)
        return learn_background(clip, config.images.background, config.images.cache)
    missing = [name for name in recording.rig.names if name not in recording.background]
    if config.images.background == "none" or len(missing) == len(recording.rig.names):
        say(f"{recording.path}: no background is used; sogjax live learn_background=true takes pictures of it")
        return Background(None, "there are no pictures of the empty scene")
    of = lambda name: (
        BackgroundImage.nothing(*working_size(*recording.rig.image_size(name)))
        if name in missing
        else BackgroundImage.from_photograph(read_still(recording, name, recording.background[name]))
    )
    return Background(tuple(of(name) for name in recording.rig.names))


def publishers_of(setup: Setup, config: LiveConfig, period: float) -> Publishers:
    """Who is told: those that are quick, and those that take longer.

    Raises:
        InputError: an address that is not known, a program that is missing, an actor that cannot be an avatar.
    """
    quick: dict[str, Publisher] = {}
    slow: dict[str, Publisher] = {}
    recording = setup.clip.recording
    if config.vmc is not None:
        quick["vmc"] = Vmc(config.vmc, setup.bodies, recording.up)
    if config.json is not None:
        quick["json"] = JsonLines(config.json, setup.bodies, recording.rig.names)
    if config.lsl is not None:
        quick["lsl"] = LabStream(config.lsl, setup.bodies, 1.0 / period)
    if config.rerun is not None:
        slow["rerun"] = RerunLive(config.rerun, recording, setup.bodies)
    return Publishers(quick, slow)


def _following(
    setup: Setup,
    background: Background,
    settings: TrackConfig,
    terms: Sequence[Term],
    pose: np.ndarray | None,
    period: float,
) -> Following:
    search = ClipSearch(setup.clip, background, setup.bodies, settings, terms)
    beside = SearchBeside(search, LiveStep(setup.tracker), lambda: yield_to_others(SEARCH))
    return Following(LiveStep(setup.tracker), setup.bodies, beside, pose, period)
