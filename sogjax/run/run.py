"""A run while its passes go on: what it is asked for, and the record of each pass that has ended."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import takewhile
from pathlib import Path
from threading import RLock
from typing import Any

from sogjax.actor.make import MadeActor
from sogjax.energy.term import Term
from sogjax.errors import InputError
from sogjax.io.frame_motions import ClipFacts, motions_of
from sogjax.io.frame_table import FramesRecord, FrameTable
from sogjax.model.body import Body
from sogjax.run.actors import ActorRequest, Actors
from sogjax.run.adjust_checks import check_window, too_short
from sogjax.run.adjust_clip import Adjusted, AdjustRequest
from sogjax.run.background import Background
from sogjax.run.clip import Clip, SampleKind
from sogjax.run.clock import StageTimes
from sogjax.run.filter import filter_name
from sogjax.run.initial_pose import SOURCES, InitialPose, PoseRequest, PoseSource
from sogjax.run.learn_occluders import LearntOccluders
from sogjax.run.recolor_actors import RecoloredActors
from sogjax.run.relearn_background import RelearntBackground
from sogjax.run.remake_actors import RemadeActors, may_gain
from sogjax.run.result import RunResult
from sogjax.run.run_files import GUESS
from sogjax.run.sampled_masks import mask_samples
from sogjax.run.setup import Setup, tracking_setup
from sogjax.run.terminal import say
from sogjax.settings.run import TrackConfig


@dataclass
class Run:
    """What a run is asked for, and what its passes have found so far."""

    clip: Clip
    config: TrackConfig
    out: Path | None = None
    """The folder of the results; None: no files are written."""
    kept: Path | None = None
    """The folder where records lie until the run has ended; None: they are not kept."""
    pose_sources: Sequence[PoseSource] = SOURCES
    terms: Sequence[Term] = ()
    """Terms of the energy, beside those of the settings."""
    adjust: AdjustRequest = field(default_factory=AdjustRequest)
    frames_given: bool = False
    """Whether the frames were tracked before, and their table is given."""
    takes_steps: bool = True
    """Whether it tracks frames by the tracker's step, which is compiled beforehand; others only take its tracker."""
    report_actors: Callable[[Sequence[MadeActor]], object] = lambda _: None
    """Takes how the actors were made."""
    before_results: Callable[[], object] = lambda: None
    """Called before the first file of the results is written: those of an earlier run go then."""
    times: StageTimes = field(default_factory=StageTimes)

    shown: tuple[FrameTable, list[Path]] | None = None
    """The frames that were tracked while files that show them were written, and these files."""
    records: dict[str, Any] = field(default_factory=dict)
    """What each pass left, by the name of the pass."""

    def __post_init__(self) -> None:
        self._lock = RLock()
        self.actors_given = "actors" in self.records
        self._first_setup: tuple[Actors | None, Setup | None] = (None, None)
        self._setup: tuple[list[Any], Setup | None] = ([None] * 4, None)

    @property
    def makes_actors(self) -> bool:
        """Whether the actors are made, and not read from files."""
        return self.config.actor is None

    @property
    def samples_to_come(self) -> tuple[SampleKind, ...]:
        """Pictures that the making of actors will look at, taken while the videos are read for the background."""
        frames_of_videos = self.makes_actors and not self.clip.recording.example_poses
        return (mask_samples(self.clip.recording),) if frames_of_videos else ()

    @property
    def background(self) -> Background:
        """What is known of the empty scene."""
        return self.records["background"]

    @property
    def actors(self) -> Actors:
        """The actors, in their own upright frames."""
        recolored: RecoloredActors | None = self.records.get("recolored")
        new = None if recolored is None else recolored.actors
        return new or self._remade.actors or self.records["actors"]

    @property
    def initial_pose(self) -> InitialPose:
        """Where tracking begins."""
        return self._remade.initial_pose or self.records["initial_pose"]

    @property
    def _remade(self) -> RemadeActors:
        return self.records.get("remade") or RemadeActors()

    @property
    def remakes_actors(self) -> bool:
        """Whether more of the background is known now than when the actors were made of it, and they may gain by that.

        Not where the initial pose comes from elsewhere, as for members of a sweep: these are to share their actors.
        """
        relearnt: RelearntBackground | None = self.records.get("relearnt")
        known = relearnt is not None and relearnt.background is not None
        return known and self.pose_sources is SOURCES and may_gain(self.actor_request, self.records["actors"])

    @property
    def recolors_actors(self) -> bool:
        """Whether this run made the actors, of frames that nobody chose.

        Not where the initial pose comes from elsewhere, as for `remakes_actors`.
        """
        made = self.makes_actors and not self.actors_given and not self.clip.recording.example_poses
        return made and self.pose_sources is SOURCES

    def setup_with(self, actors: Actors) -> Setup:
        """What is tracked with, knowing what was learnt so far, with other actors."""
        return self._knowing(tracking_setup(self.clip, self.background, actors.bodies, self.config, self.terms))

    @property
    def adjusted(self) -> Adjusted | None:
        """The adjusted clip; None where it was not, or not yet, adjusted."""
        return self.records.get("adjusted")

    @property
    def actor_request(self) -> ActorRequest:
        """The actors that are wanted."""
        return replace(ActorRequest.of_track(self.clip, self.config), background=lambda: self.background)

    @property
    def pose_request(self) -> PoseRequest:
        """The initial pose that is wanted."""
        picture = None if self.out is None else GUESS.of(self.out)
        return PoseRequest(self.clip, self.background, self.actors, self.config, self.terms, picture=picture)

    @property
    def first_setup(self) -> Setup:
        """What is tracked with before anything was learnt by tracking."""
        with self._lock:
            of_actors, made = self._first_setup
            if made is None or of_actors is not self.actors:
                made = tracking_setup(self.clip, self.background, self.actors.bodies, self.config, self.terms)
                self._first_setup = self.actors, made
            return made

    @property
    def setup(self) -> Setup:
        """What is tracked with, knowing what was learnt so far."""
        with self._lock:  # a thread makes it while the initial pose is searched for
            first, learnt = self.first_setup, self._learnt
            known, made = self._setup
            if made is None or any(now is not before for now, before in zip([first, *learnt], known, strict=True)):
                made = self._knowing(first)
                self._setup = [first, *learnt], made
            return made

    @property
    def _learnt(self) -> list[Any]:
        """What passes learnt that the tracker is to know; None: nothing, or not yet."""
        return [self.records.get(name) for name in ("relearnt", "occluders", "keypoint_bias")]

    def _knowing(self, setup: Setup) -> Setup:
        """A setup that knows what was learnt so far."""
        for record in self._learnt:
            setup = setup if record is None else record.in_setup(setup)
        return setup

    @property
    def hides_something(self) -> bool:
        """Whether something was learnt to stand in front of the actors, in frames that this run tracks."""
        occluders: LearntOccluders | None = self.records.get("occluders")
        return self.tracks and occluders is not None and occluders.hidden is not None

    @cached_property
    def adjusts(self) -> bool:
        """Whether the clip is adjusted: it was asked for, and the clip is long enough; if not, that is said.

        Raises:
            InputError: there are several actors, or its pictures do not fit into memory.
        """
        if not self.config.adjust or not self.tracks:
            return self.config.adjust
        body, *others = self.actors.bodies
        if others:
            raise InputError("adjust=true: only a clip of one actor can be adjusted; leave adjust=true out")
        if (reason := too_short(len(self.clip.numbers))) is not None:
            say(f"adjust=true: {reason}")
            return False
        check_window(len(self.clip.recording.rig), body.num_blobs, len(self.clip.numbers))
        return True

    @property
    def frames(self) -> FrameTable:
        """The frames as they hold by now: those of the last pass that left any."""
        return _last_table(self.records.values())

    @property
    def unadjusted(self) -> FrameTable:
        """The frames as they held before they were adjusted."""
        before = takewhile(lambda name: name != "adjusted", self.records)
        return _last_table(self.records[name] for name in before)

    @property
    def final_setup(self) -> Setup:
        """The clip and the actors that the final frames are of."""
        return self.setup if self.adjusted is None else self.adjusted.setup(self.first_setup)

    @property
    def tracks(self) -> bool:
        """Whether this run tracks the frames."""
        return not self.frames_given

    @property
    def result(self) -> RunResult:
        """The result, once it was judged."""
        return self.records["result"]

    @property
    def files(self) -> list[Path]:
        """The files that were written."""
        return self.records["files"]

    @property
    def result_so_far(self) -> RunResult:
        """The motions, without anything that was thought of them."""
        setup, table, recording = self.final_setup, self.frames, self.clip.recording
        motions = motions_of(table, setup.bodies, ClipFacts.of(recording))
        if table.unfiltered_pose is not None and self.config.outputs.filter is not None:
            named = filter_name(self.config.outputs.filter)
            motions = {name: replace(motion, filtered_by=named) for name, motion in motions.items()}
        image_blobs = float(self.unadjusted.num_matching.mean())
        missing = recording.num_missing(self.clip.numbers)
        return RunResult(setup.clip.recording, setup.bodies, motions, self.times, image_blobs, missing=missing)

    @property
    def made_bodies(self) -> list[Body]:
        """Actors whose files are among the results, since the run made or adjusted them."""
        if self.adjusted is not None:
            return [self.adjusted.actor]
        return [*self.actors.bodies] if self.makes_actors else []


def _last_table(records: Iterable[Any]) -> FrameTable:
    return [record.table for record in records if isinstance(record, FramesRecord)][-1]
