"""A simulated vehicle, the agent's core with all its handlers, a tower's hub and browsers, on one clock: every message
between them is encoded and decoded as on the wire. What comes from the vehicle can be replaced on its way.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import msgspec
from hub_world import FakeAgent, FakeBrowser, HubWorld, record
from worlds.held_copter import ARM, mode_command, takeoff
from worlds.simulated_copter import HOME, SimulatedCopter

from onboard_agent.autonomy.service import ControllerHandler
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.landing.handler import LandingTargetHandler
from onboard_agent.onboard import Onboard
from onboard_agent.transactions.file_sending import NotSent
from onboard_agent.transactions.handler import TransactionHandler
from onboard_agent.transactions.log_files import LogFiles
from onboard_agent.transactions.log_handler import LogHandler
from onboard_agent.transactions.metadata_service import MetadataService
from onboard_agent.transactions.parameter_files import ParameterFiles
from onboard_agent.transactions.parameter_handler import ParameterHandler
from server.kernel.people import UserRef
from server.live import live_messages as live
from server.live.live_messages import encode_event
from server.operations.core.operation import Lane, Operation, Order, Step
from server.operations.core.refusals import DroneBusy, DroneOffline
from simulator.modes import Mode
from wire.control_messages import Welcome, decode_to_agent, decode_to_tower, encode_message
from wire.dialect import build, mavlink
from wire.frame_stream import FrameStream
from wire.ids import DroneId, UserId
from wire.negotiation import GROUPS, TOWER_TAKES
from wire.open_holds import OPEN_HOLDS
from wire.plans import PlanKind
from wire.tagged import tag
from wire.transactions import (
    CommandWork,
    LogDownloadWork,
    LogListWork,
    ParametersReadWork,
    ParametersWriteWork,
    PlanDownloadWork,
)
from wire.zones.kinds import ZoneKind, ZoneRule
from wire.zones.zone import Zone, ZoneShape

STEP_S: Final = 0.025
ONE: Final = DroneId(1)
_ALICE: Final = UserRef(UserId(1), "alice")
_M: Final = 1 / 111_319.5
_NEAR: Final = tuple((HOME.lat_deg + north * _M, HOME.lon_deg + east * _M) for north, east in ((300, 300), (600, 300),
                                                                                              (600, 600)))  # fmt: skip


def _read(work: Any, lane: Lane, name: Any) -> Order:
    return Order(name, lane, [Step(work, 30.0)], False)


WORK: Final = (
    *(_read(PlanDownloadWork(kind), Lane.PLANS, "plan_download") for kind in PlanKind),
    _read(ParametersReadWork(again=True), Lane.PARAMETERS, "parameters_read"),
    Order("parameters_write", Lane.PARAMETERS, [Step(ParametersWriteWork((("RTL_ALT", 1500.0),)), 30.0)], True),
    _read(LogListWork(), Lane.LOGS, "log_list"),
    _read(LogDownloadWork(1), Lane.LOGS, "log_download"),
    Order("command", Lane.COMMANDS, [Step(CommandWork(mavlink.MAV_CMD_DO_SET_MODE, (1.0, 5.0) + (0.0,) * 5), 5.0)],
          True),
)  # fmt: skip


class _NoTower:
    """A FileSender that is refused."""

    state = NotSent("no")

    def begin(self, transaction_id: int, path: Path) -> None:
        """Sends nothing."""

    def stop(self) -> None:
        """Nothing goes on."""


class _NoPad:
    """A watch of a landing pad that sees none."""

    def look(self, wanted: bool) -> None:
        """Looks at nothing."""

    def sightings(self) -> list[Any]:
        return []


def _never() -> Any:
    raise AssertionError("no controller was asked for")


def _handlers(maker: FrameMaker) -> list[TransactionHandler]:
    """As `Agent._make_handlers`."""
    parameters = ParameterHandler(maker, ParameterFiles(None))
    return [
        MetadataService(maker, parameters_busy=parameters.busy),
        parameters,
        LogHandler(maker, LogFiles(None), _NoTower()),
        ControllerHandler(maker, {}, _never),
        LandingTargetHandler(maker, _NoPad),
    ]


class VehicleToBrowser:
    """alice has the controls of drone 1, drone 2 flies beside it, and an admin watches. `replaced`: called with each
    frame of the vehicle, returns what the agent hears instead."""

    def __init__(self) -> None:
        self.now = 50.0
        self.replaced: Callable[[bytes], bytes] = lambda frame: frame
        self.copter = SimulatedCopter(self.now, flight={"boot_s": 0.5})
        self.world = HubWorld(height_limit_m=120.0)
        self.hub = self.world.hub
        self.world.apply(record(1, (1,), holder=1, epoch=5), record(2, (1, 2)))
        shape = ZoneShape(points=_NEAR)
        self.hub.zones.replace(
            [
                Zone(id=1, name="Airport", kind=ZoneKind.NO_FLY, rule=ZoneRule.REFUSE, shape=shape),
                Zone(id=2, name="Town", kind=ZoneKind.HEIGHT_LIMIT, rule=ZoneRule.WARN, shape=shape, ceiling_m=100.0),
            ]
        )
        self.onboard = Onboard(now=self.now, speaks_first=True, make_handlers=_handlers)
        self._stream = FrameStream()
        self.alice, self.admin = self.world.browser(1), self.world.browser(9)
        self.end = FakeAgent(self.hub, 1, link_id=101, now=self.now, takes={*GROUPS.values(), OPEN_HOLDS})
        self.other = FakeAgent(self.hub, 2, link_id=102, now=self.now)
        self.told = 0
        """Events that browsers were sent."""
        self.reported = 0
        """Messages that the agent sent."""
        self._beside_at = self._second_at = 0.0
        self.onboard.welcomed(
            Welcome(
                drone_id=ONE, name="Kestrel", link_id=101, public_key=b"k" * 32, udp_port=1, epoch=5, holder="alice",
                holder_present=True, takes=TOWER_TAKES,
            ),
            self.now,
        )  # fmt: skip

    # The vehicle.

    def fly(self) -> None:
        """It takes off and flies by hand; the pilot's browser answers."""
        self.pass_time(4.0)
        for frame in (mode_command(Mode.GUIDED), ARM, takeoff(20.0)):
            self.pilot_sends(frame)
            self.pass_time(0.5)
        self.pass_time(8.0)
        assert self.copter.height_m > 10.0

    def say(self, *frames: bytes) -> None:
        """These frames come on the autopilot's line."""
        self._exchange(self.onboard.from_autopilot(self._stream.feed(b"".join(frames)), self.now))

    def beat(self, *, armed: bool = True) -> None:
        """A heartbeat of the vehicle, which does not take part otherwise."""
        message = mavlink.MAVLink_heartbeat_message(2, 3, 0xD1 if armed else 0x51, 5, 4, 3)
        self.say(build(message, system_id=1, component_id=1, sequence=0))

    # The pilot.

    def pilot_sends(self, *frames: bytes) -> None:
        for frame in frames:
            self.alice.send(tag(ONE, frame), now=self.now)
        self._exchange([])

    def work(self) -> list[Operation]:
        """alice asks for all that can be asked of a drone, as far as it is not doing that already."""
        begun = []
        drone = self.hub.state.drones[ONE]
        for order in WORK:
            try:
                begun.append(self.hub.operations.begin(drone, order, by=_ALICE, now=self.now))
            except (DroneBusy, DroneOffline):
                continue
        return begun

    # Time.

    def pass_time(self, for_s: float, *, with_vehicle: bool = True) -> None:
        end = self.now + for_s - STEP_S / 2
        while self.now < end:
            self.now += STEP_S
            for frame in self.copter.step(self.now) if with_vehicle else ():
                self.say(self.replaced(frame))
            self.tick()

    def tick(self) -> None:
        """Agent, tower and browsers do what time asks of them."""
        self.onboard.tower_heard(self.now)
        self.onboard.round_trip(0.02)
        self.onboard.tick(self.now)
        if self.now >= self._beside_at:
            self._beside_at = self.now + 0.5
            lat_e7, lon_e7 = int(HOME.lat_deg * 1e7) + 300, int(HOME.lon_deg * 1e7)
            place = mavlink.MAVLink_global_position_int_message(0, lat_e7, lon_e7, 500_000, 15_000, 0, 0, 0, 0)
            self.other.send(build(place, system_id=1, component_id=1, sequence=0), now=self.now)
            self.other.answer_pings(self.now)
        self.end.answer_pings(self.now)
        self._exchange(self.onboard.frames_to_tower(self.now))
        self.hub.tick(self.now)
        if self.now >= self._second_at:
            self._second_at = self.now + 1.0
            self.hub.each_second(self.now)
        self._exchange([])
        for browser in (self.alice, self.admin):
            self._read(browser)

    def _exchange(self, frames: list[bytes]) -> None:
        if frames:
            self.end.send(*frames, now=self.now)
        for message in self.onboard.messages_to_tower(self.now):
            self.reported += 1
            heard = decode_to_tower(encode_message(message))
            self.hub.reports.receive(self.end.link, heard, self.hub.state.clock())
        self._receive()
        posted = list(self.end.posted)
        self.end.posted.clear()
        for order in posted:
            self.onboard.message(decode_to_agent(encode_message(order)), self.now)
        self.copter.receive(self.onboard.frames_to_autopilot())

    def _receive(self) -> None:
        datagrams, self.end.sent_to = self.end.sent_to, []
        for datagram, _ in datagrams:
            received = self.end.sealed.receive(datagram, self.now)
            if received.frames is not None:
                self.onboard.from_tower(received.frames, self.now)
            elif received.urgent is not None:
                self.onboard.message(decode_to_agent(received.urgent), self.now)

    def _read(self, browser: FakeBrowser) -> None:
        for event in browser.events():
            self.told += 1
            check_readable(event)
            if isinstance(event, live.Ping):
                browser.browser.trip.pong(event.sequence, self.now)
        browser.frames(self.now)

    def check(self) -> None:
        """Nobody has lost a link, and what REST answers of the drone can be read."""
        assert (self.end.closed, self.other.closed) == ([], [])
        assert (self.alice.closed, self.admin.closed) == ([], [])
        assert self.hub.state.drones[ONE].online
        for drone in self.hub.state.drones.values():
            check_json(drone.view_for(UserId(1), self.alice.browser.viewer.role).model_dump_json())


def check_readable(event: live.ToBrowser) -> None:
    """What a browser is sent is JSON with finite numbers, and each value has the type that the API states."""
    text = encode_event(event)
    check_json(text)
    if not isinstance(event, live.Relayed):
        msgspec.json.decode(text, type=type(event), dec_hook=_view)


def check_json(text: str) -> None:
    def refuse(word: str) -> Any:
        raise AssertionError(f"{word} in {text}")

    json.loads(text, parse_constant=refuse)


def _view(kind: Any, value: Any) -> Any:
    return kind.model_validate(value)
