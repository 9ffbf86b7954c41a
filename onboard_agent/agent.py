"""Assembles and runs the agent: port, link, and the decisions between them. The only module that knows all parts."""

import asyncio
import logging
import secrets
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

from onboard_agent import VERSION
from onboard_agent.autonomy.service import ControllerHandler
from onboard_agent.autonomy.setting import BUILT_IN, names_on_board, sources_on_board
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.autopilot_port.port import AutopilotPort
from onboard_agent.black_box.service import BlackBox
from onboard_agent.failsafe.hold_files import HoldFiles
from onboard_agent.failsafe.hold_memory import HoldStore, NoHoldStore
from onboard_agent.link.identity import Identity
from onboard_agent.link.tower_file import TowerFile
from onboard_agent.link.tower_url import TowerUrl
from onboard_agent.onboard import Onboard
from onboard_agent.signing.handler import SigningHandler
from onboard_agent.signing.key_file import KeyFile
from onboard_agent.signing.signed_line import SignedLine
from onboard_agent.sockets.data_socket import ANY_UPLINK
from onboard_agent.sockets.file_sender import TowerFileSender
from onboard_agent.sockets.tower_link import TowerLink
from onboard_agent.state_directory import claim
from onboard_agent.system_file import SystemFile
from onboard_agent.systemd import Systemd
from onboard_agent.transactions.handler import TransactionHandler
from onboard_agent.transactions.journal import JournalStore, NoJournal
from onboard_agent.transactions.journal_files import JournalFiles
from onboard_agent.transactions.journal_thread import JournalThread
from onboard_agent.transactions.log_files import LogFiles
from onboard_agent.transactions.log_handler import LogHandler
from onboard_agent.transactions.metadata_service import MetadataService
from onboard_agent.transactions.parameter_files import ParameterFiles
from onboard_agent.transactions.parameter_handler import ParameterHandler
from onboard_agent.update.handler import UpdateHandler
from onboard_agent.update.installer import TowerUpdateInstaller
from onboard_agent.update.launch import installed_version
from onboard_agent.update.releases import Releases
from onboard_agent.video.camera_setting import NO_CAMERA
from onboard_agent.video.child import VideoChild
from onboard_agent.video.core.lines import SetUp
from onboard_agent.video.core.service import VideoService
from wire.agent_update import AGENT_UPDATE
from wire.black_box import BlackBoxWanted
from wire.content import Frames
from wire.control_messages import ToAgent, Welcome
from wire.controllers import CONTROLLERS, offers
from wire.frame_stream import FrameStream
from wire.own_system import OwnSystem
from wire.signing_key import SIGNING
from wire.video import VIDEO, VideoWanted
from wire.zones.nearby import ZONES

if TYPE_CHECKING:
    from onboard_agent.autonomy.child import ControllerChild
    from onboard_agent.autonomy.core.lines import CameraSetting
    from onboard_agent.landing.child import PadWatch

_log = logging.getLogger(__name__)

TICK_S: Final = 0.025
"""Half the interval of centred sticks, the agent's fastest periodic output."""

SUMMARY_S: Final = 60.0


@dataclass(frozen=True)
class AgentSettings:
    """Settings from the command line, read once."""

    tower: TowerUrl
    identity: Identity
    port: AutopilotPort
    uplinks: tuple[str, ...] = (ANY_UPLINK,)
    """Interface names or local addresses. The agent sends each datagram over all of them."""
    camera: str = NO_CAMERA
    """Camera as given on the command line (onboard_agent.video.sources.schemes)."""
    log_level: str = "info"
    """Log level of the video process, which has its own log."""
    state: Path | None = None
    """Folder for this drone's persistent state. None: nothing persists, and no plan is written."""
    black_box_hz: int = 0
    """How often it has attitude, sticks and outputs; 0: as often as the tower."""
    black_box_mb: int = 0
    """Room for the black box; 0: there is none."""
    releases: Releases | None = None
    """Where updates of the agent are installed. None: nowhere."""
    release_keys: tuple[str, ...] = ()
    """Who may sign them."""
    controllers: Mapping[str, str] = field(default_factory=dict)
    """FILE:CLASS of controllers, by name (onboard_agent.autonomy.setting)."""
    landing: tuple[str, str] | None = None
    """Landing pad and camera (onboard_agent.vision.pad_setting); None: no precision landing."""
    controller_cameras: "Sequence[CameraSetting]" = ()
    """Cameras for controllers (onboard_agent.autonomy.setting)."""
    payload_release: str = ""
    """How a controller lets the payload go (onboard_agent.autonomy.core.payload_release)."""
    system_id: int | None = None
    """The only MAVLink system on the line that this agent serves. None: the first that it hears."""
    neighbours: tuple[int, ...] = ()
    """The systems of the other drones on its line that this process serves."""
    signing: tuple[SignedLine, KeyFile] | None = None
    """Of `port`, and where its keys are kept. None: nothing is ever signed."""
    speaks_to_systemd: bool = True
    """False for a second drone on the line of another one, in the same process."""
    on_trial: int | None = None
    """The tower's transaction that waits for this process (onboard_agent.update.launch)."""


class StartAgain(Exception):
    """Another release was installed, and is to run."""


class Agent:
    """The agent process. Create it inside a running event loop."""

    def __init__(self, settings: AgentSettings) -> None:
        self._loop = asyncio.get_running_loop()
        self._port = settings.port
        self._port.on_open = self._port_opened
        self._state = settings.state
        self._controllers = settings.controllers
        self._controller_cameras = settings.controller_cameras
        self._payload_release = settings.payload_release
        self._controller: ControllerChild | None = None
        self._landing = settings.landing
        self._signing = settings.signing
        self._pad_watch: PadWatch | None = None
        self._switched = asyncio.Event()
        self._installer = TowerUpdateInstaller(
            lambda: self._link.tower,
            lambda: self._link.ticket,
            settings.releases,
            settings.release_keys,
            on_trial=settings.on_trial,
            on_switched=self._switched.set,
            uplinks=settings.uplinks,
        )
        self._files = TowerFileSender(lambda: self._link.tower, lambda: self._link.ticket, settings.uplinks)
        journal, self._holds = self._lasting(settings.state)
        self._system_file = SystemFile(settings.state)
        self._kept_system = self._system_file.read()
        self._onboard = Onboard(
            now=self._loop.time(),
            speaks_first=self._port.speaks_first,
            narrow_line=self._port.narrow,
            steps_reported=secrets.randbits(31),
            journal=journal,
            holds=self._holds,
            make_handlers=self._make_handlers,
            own=OwnSystem(
                only=settings.system_id,
                remembered=self._kept_system,
                neighbours=settings.neighbours,
                now=self._loop.time(),
            ),
            record=lambda frames, now: self._black_box.add(frames, now),
            research_hz=settings.black_box_hz if settings.black_box_mb else 0,
        )
        has_camera = settings.camera != NO_CAMERA
        # Two agents of one drone would complete and remove each other's flights.
        box = None if settings.state is None or isinstance(journal, NoJournal) else settings.state / "black-box"
        self._black_box = BlackBox(box, settings.black_box_mb, self._loop.time())
        controllers = (CONTROLLERS, ZONES, *offers(names_on_board(settings.controllers)))
        signing = () if settings.signing is None else (SIGNING,)
        takes = (AGENT_UPDATE, *signing, *controllers, *((VIDEO,) if has_camera else ()), *self._black_box.takes)
        self._link = TowerLink(
            settings.tower, settings.identity, self, settings.uplinks, takes, TowerFile(settings.state)
        )
        self._video = VideoService(has_camera=has_camera)
        self._video_child = VideoChild(
            self._video,
            SetUp(
                tower=str(settings.tower),
                camera=settings.camera,
                uplinks=settings.uplinks,
                log_level=settings.log_level,
            ),
            self._send_video_state,
            tower=lambda: str(self._link.tower),
        )
        self._stream = FrameStream()
        self._systemd = Systemd(speaks=settings.speaks_to_systemd)
        self._summarised: Counter[str] = Counter()
        self._unknown_logged = 0

    @staticmethod
    def _lasting(state: Path | None) -> tuple[JournalStore, HoldStore]:
        """Returns the plan journal and the store for an open hold: on disk if there is a usable state folder."""
        if state is None:
            return NoJournal(), NoHoldStore()
        why_not = claim(state)
        if why_not is not None:
            _log.error("%s", why_not)
            return NoJournal(), NoHoldStore()
        return JournalThread(JournalFiles(state / "plans")), HoldFiles(state)

    def _make_handlers(self, maker: FrameMaker) -> list[TransactionHandler]:
        """Returns the handlers for work at the drone that needs a disk or a network."""
        state = self._state
        self._controller_handler = ControllerHandler(
            maker,
            self._controllers,
            self._make_controller,
            cameras=self._controller_cameras,
            release=self._payload_release,
            share=self._share_frames,
        )
        parameters = ParameterHandler(maker, ParameterFiles(None if state is None else state / "parameters"))
        return [
            # First, so that it closes its file before the parameter handler opens its own.
            MetadataService(maker, parameters_busy=parameters.busy),
            parameters,
            UpdateHandler(self._installer, running=VERSION, installed=installed_version()),
            LogHandler(maker, LogFiles(None if state is None else state / "logs"), self._files),
            self._controller_handler,
            *self._landing_handlers(maker),
            *self._signing_handlers(maker),
        ]

    def _share_frames(self, path: str) -> None:
        self._video.share(path, self._loop.time())
        self._video_child.wake()

    def _landing_handlers(self, maker: FrameMaker) -> list[TransactionHandler]:
        if self._landing is None:
            return []
        from onboard_agent.landing.handler import LandingTargetHandler  # not in the memory of every other agent

        return [LandingTargetHandler(maker, self._make_pad_watch)]

    def _signing_handlers(self, maker: FrameMaker) -> list[TransactionHandler]:
        if self._signing is None:
            return []
        return [SigningHandler(maker, *self._signing, unix_s=time.time)]

    def _make_pad_watch(self) -> "PadWatch":
        from onboard_agent.landing.child import PadWatch

        assert self._landing is not None
        self._pad_watch = PadWatch(*self._landing)
        return self._pad_watch

    def _make_controller(self) -> "ControllerChild":
        from onboard_agent.autonomy.child import ControllerChild  # not in the memory of every other agent

        self._controller = ControllerChild()
        return self._controller

    async def run(self) -> None:
        """Runs until cancelled. Raises StartAgain, and Unusable (not in an exception group) for errors that a restart
        does not cure."""
        _log.info("agent of drone %s: autopilot on %s", self._link.drone_id, self._port.name)
        tasks = [
            asyncio.create_task(self._port.run(self._from_port), name="port"),
            asyncio.create_task(self._link.run(), name="link"),
            asyncio.create_task(self._tick_for_ever(), name="tick"),
            asyncio.create_task(self._summarise_for_ever(), name="summary"),
            asyncio.create_task(self._video_child.run(), name="video"),
            asyncio.create_task(self._until_switched(), name="update"),
        ]
        self._black_box.start()
        self._systemd.ready()
        describing = asyncio.create_task(self._describe_controllers(), name="describing")
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
            raise RuntimeError("a part of the agent ended by itself")
        finally:
            if not self._switched.is_set():
                self._systemd.stopping()
            self._installer.stop()
            if self._controller is not None:
                self._controller.stop()
            if self._pad_watch is not None:
                self._pad_watch.look(False)
            self._files.stop()
            self._holds.close()
            if self._signing is not None:
                self._signing[1].close()
            self._black_box.stop(self._loop.time())
            for task in (*tasks, describing):
                task.cancel()
            await asyncio.gather(*tasks, describing, return_exceptions=True)

    async def _describe_controllers(self) -> None:
        """Asks the controllers that are not built in for their settings, once."""
        sources = {
            name: source
            for name, source in sources_on_board(self._controllers).items()
            if source or name not in BUILT_IN
        }
        if not sources:
            return
        from onboard_agent.autonomy.describing import descriptions  # not in the memory of every other agent

        async for described in descriptions(sources):
            self._controller_handler.described(described)

    async def _until_switched(self) -> None:
        await self._switched.wait()
        raise StartAgain

    # From the autopilot

    def _port_opened(self) -> None:
        self._stream = FrameStream()

    def _from_port(self, data: bytes) -> None:
        frames = self._stream.feed(data)
        if not frames:
            return
        now = self._loop.time()
        passed = self._onboard.from_autopilot(frames, now)
        self._send_up(passed)
        self._send_down()
        if self._onboard.has_news:
            self._report()

    def _send_up(self, frames: list[bytes]) -> None:
        if frames:
            self._link.send_frames(self._onboard.downlink.epoch, frames)

    # From the tower (LinkUser)

    def link_up(self, welcome: Welcome) -> None:
        self._systemd.linked()
        self._onboard.welcomed(welcome, self._loop.time())
        self._black_box.link_up(welcome.takes)
        self._flush()
        self._video.link_up(welcome.takes)
        self._send_video_state()

    def link_down(self) -> None:
        self._onboard.link_broken(self._loop.time())
        self._video.link_down(self._loop.time())
        self._video_child.wake()

    def link_resumed(self) -> None:
        self._onboard.resumed()
        self._black_box.link_resumed()
        self._flush()
        self._video.link_resumed()
        self._send_video_state()

    def message(self, message: ToAgent) -> None:
        if isinstance(message, VideoWanted):
            self._video.wanted(message, self._loop.time())
            self._video_child.wake()
            self._send_video_state()
            return
        if isinstance(message, BlackBoxWanted):
            self._black_box.wanted(message)
            return
        self._onboard.message(message, self._loop.time())
        self._tick()

    def frames(self, frames: Frames) -> None:
        self._onboard.from_tower(frames, self._loop.time())
        self._send_down()

    def tower_heard(self) -> None:
        self._onboard.tower_heard(self._loop.time())

    # From the video process

    def _send_video_state(self) -> None:
        state = self._video.messages_to_tower() if self._link.room else None  # else with the next report
        if state is not None:
            self._link.send_message(state)

    # Time

    async def _tick_for_ever(self) -> None:
        due = self._loop.time()
        while True:
            self._tick()
            self._systemd.alive(self._loop.time())
            autopilot = self._onboard.autopilot
            self._systemd.status(linked=self._link.up, heard=autopilot.heard, armed=autopilot.armed)
            due = max(due + TICK_S, self._loop.time())
            await asyncio.sleep(due - self._loop.time())

    def _tick(self) -> None:
        now = self._loop.time()
        stream = self._onboard.stream
        measured = self._link.measured(now) if stream.wants_measurement(now) else None
        if measured is not None:
            stream.measured(measured, now)
        if self._link.rtt_s is not None:
            self._onboard.round_trip(self._link.rtt_s)
        if self._signing is not None:
            self._onboard.autopilot.line_signing = self._signing[0].state(now)
        self._onboard.tick(now)
        self._link.closely = self._onboard.hands_on
        self._send_up(self._onboard.frames_to_tower(now))
        autopilot = self._onboard.autopilot
        if autopilot.system_id is not None and autopilot.system_id != self._kept_system:
            self._kept_system = autopilot.system_id
            self._loop.run_in_executor(None, self._system_file.keep, autopilot.system_id)
        self._black_box.tick(now, armed=autopilot.armed, heard=autopilot.heard)
        if self._link.up:
            for message in self._black_box.messages(now, self._link.room):
                self._link.send_message(message)
        self._flush()

    def _flush(self) -> None:
        self._send_down()
        self._report()

    def _send_down(self) -> None:
        frames = self._onboard.frames_to_autopilot()
        for frame in frames:
            self._port.send(frame)
        if frames:  # the autopilot has them already
            self._black_box.add(frames, self._loop.time())

    def _report(self) -> None:
        for message in self._onboard.messages_to_tower(self._loop.time(), self._link.room):
            self._link.send_message(message)

    async def _summarise_for_ever(self) -> None:
        while True:
            await asyncio.sleep(SUMMARY_S)
            onboard = self._onboard
            totals = (
                onboard.counts
                + onboard.downlink.counts
                + onboard.stream.thinner.counts
                + self._link.counts
                + self._port.counts
            )
            new = totals - self._summarised
            self._summarised = totals
            unknown = onboard.stream.thinner.unknown_passed
            if unknown > self._unknown_logged:
                _log.info(
                    "not thinned, being unknown here: %d frames in the last minute", unknown - self._unknown_logged
                )
                self._unknown_logged = unknown
            if new:
                _log.info("not passed on in the last minute: %s", ", ".join(f"{n} {why}" for why, n in new.items()))
