"""A line between the agent's plan handler and an autopilot's server half, with a fake clock and injected faults."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Protocol

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.transactions.plan_handler import PlanHandler
from onboard_agent.transactions.retry_policy import RetryPolicy
from simulator.ardupilot import ARDUPILOT
from simulator.dialect import Codec, Message, mavlink
from simulator.failure_modes import Failure
from simulator.flavour import Flavour
from simulator.flight import Flight
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.mission_plan import Item
from simulator.mission_plan import PlanKind as ServerKind
from simulator.missions import MissionServer
from simulator.parameters import Parameters
from wire.autopilots.ardupilot_plans import ArduPilot
from wire.autopilots.px4_plans import Px4
from wire.plans import Plan, PlanItem, PlanKind
from wire.transactions import (
    Outcome,
    PlanClearWork,
    PlanDownloadWork,
    PlanOnBoard,
    PlanUploadWork,
    PlanVerifyWork,
    Transaction,
    TransactionProgress,
    TransactionResult,
)

STEP_S = 0.01
HOME = Place(47.397742, 8.545594, 488.0)
SERVER_KINDS = {
    PlanKind.MISSION: ServerKind.MISSION,
    PlanKind.FENCE: ServerKind.FENCE,
    PlanKind.RALLY: ServerKind.RALLY,
}
Fault = Callable[[int, Message], int]
"""Takes the number of earlier frames in that direction and the message. Returns how many copies arrive."""


def waypoints(count: int, *, alt_m: float = 20.0) -> Plan:
    return tuple(PlanItem(16, 3, (0.0, 0.0, 0.0, 0.0), 473977420 + i, 85455940, alt_m) for i in range(count))


OLD, NEW = waypoints(3), waypoints(5, alt_m=40.0)


class Killed(BaseException):
    """Raised where the agent's process is killed."""


class MemoryJournal:
    """A disk. `dies_at`: kills the process at that call, before (0, 2, ...) or after (1, 3, ...) it took effect."""

    def __init__(self) -> None:
        self.records: dict[PlanKind, bytes] = {}
        self.dies_at: int | None = None
        self.calls = 0
        self.broken = False

    def load(self, kind: PlanKind) -> bytes | None:
        return self.records.get(kind)

    def save(self, kind: PlanKind, record: bytes) -> None:
        if self.broken:
            raise OSError(28, "No space left on device")
        self._call(lambda: self.records.__setitem__(kind, record))

    def remove(self, kind: PlanKind) -> None:
        self._call(lambda: self.records.pop(kind, None))

    def _call(self, action: Callable[[], Any]) -> None:
        for half in range(2):
            if self.calls == self.dies_at:
                self.dies_at = None
                raise Killed
            self.calls += 1
            if half == 0:
                action()


class Server(Protocol):
    """The autopilot's half."""

    now_s: float

    def receive(self, message: Message, peer: tuple[int, int]) -> None: ...
    def tick(self) -> None: ...
    def reset(self) -> None: ...
    def plan(self, kind: PlanKind) -> list[Item]: ...
    def load(self, kind: PlanKind, items: list[Item]) -> None: ...


class SimulatorServer:
    """The simulator's own: collects an upload beside the plan."""

    def __init__(
        self, send: Callable[[Message], None], failures: Iterable[Failure] = (), flavour: Flavour = ARDUPILOT
    ) -> None:
        self.failures = set(failures)
        self._flavour = flavour
        self._flight = Flight(FlightSettings(HOME), Parameters(), self.failures, flavour)
        self._send = send
        self._half = MissionServer(self._flight, flavour, send, self.reset)
        self.now_s = 0.0
        self.on_reset: Callable[[], None] = lambda: None

    def reset(self) -> None:
        """Reboots: stored plans stay."""
        self._half = MissionServer(self._flight, self._flavour, self._send, self.reset)
        self.on_reset()

    def receive(self, message: Message, peer: tuple[int, int]) -> None:
        self._flight.now_s = self.now_s
        self._half.receive(message, peer)

    def tick(self) -> None:
        self._flight.now_s = self.now_s
        self._half.tick()

    def plan(self, kind: PlanKind) -> list[Item]:
        return self._flight.plans.items[SERVER_KINDS[kind]]

    def load(self, kind: PlanKind, items: list[Item]) -> None:
        self._flight.plans.store(SERVER_KINDS[kind], items, None)


class InPlaceServer:
    """Behaves as ArduPilot: MISSION_COUNT truncates the plan, each item goes into its place as it arrives, and while an
    upload is open everything else is denied, for 8 s after the last message."""

    def __init__(self, send: Callable[[Message], None]) -> None:
        self._send = send
        self.items: dict[PlanKind, list[Item]] = {kind: [] for kind in PlanKind}
        self._receiving: tuple[PlanKind, int, int] | None = None
        self._heard_s = self._asked_s = 0.0
        self._peer = (0, 0)
        self.now_s = 0.0

    def receive(self, message: Message, peer: tuple[int, int]) -> None:
        name, self._peer = message.get_type(), peer
        if name == "MISSION_ACK":
            return
        kind = list(PlanKind)[message.mission_type]
        items = self.items[kind]
        if name == "MISSION_COUNT":
            del items[message.count :]
            self._receiving, self._heard_s = (kind, 0, message.count), self.now_s
            self._ask()
        elif name == "MISSION_ITEM_INT":
            self._take(message, kind, items)
        elif self._receiving is not None:
            self._ack(kind, mavlink.MAV_MISSION_DENIED)
        elif name == "MISSION_CLEAR_ALL":
            items.clear()
            self._ack(kind, mavlink.MAV_MISSION_ACCEPTED)
        elif name == "MISSION_REQUEST_LIST":
            self._send(mavlink.MAVLink_mission_count_message(*peer, len(items), message.mission_type))
        elif message.seq < len(items):
            item = items[message.seq]
            fields = (message.seq, int(item.frame), item.command, 0, item.autocontinue, *item.params, item.x, item.y)
            self._send(mavlink.MAVLink_mission_item_int_message(*peer, *fields, item.z, message.mission_type))
        else:
            self._ack(kind, mavlink.MAV_MISSION_INVALID_SEQUENCE)

    def _take(self, message: Message, kind: PlanKind, items: list[Item]) -> None:
        if self._receiving is None:
            self._ack(kind, mavlink.MAV_MISSION_ERROR)
            return
        _, wanted, count = self._receiving
        if message.seq != wanted:
            self._ack(kind, mavlink.MAV_MISSION_INVALID_SEQUENCE)
            return
        params = (message.param1, message.param2, message.param3, message.param4)
        items[wanted : wanted + 1] = [
            Item(message.command, message.frame, params, message.x, message.y, message.z, message.autocontinue)
        ]
        self._heard_s = self.now_s
        if wanted + 1 == count:
            self._receiving = None
            self._ack(kind, mavlink.MAV_MISSION_ACCEPTED)
        else:
            self._receiving = (kind, wanted + 1, count)
            self._ask()

    def tick(self) -> None:
        if self._receiving is None:
            return
        if self.now_s - self._heard_s >= 8.0:
            kind, self._receiving = self._receiving[0], None
            self._ack(kind, mavlink.MAV_MISSION_OPERATION_CANCELLED)
        elif self.now_s - self._asked_s >= 1.0:
            self._ask()

    def reset(self) -> None:
        """Reboots: stored plans stay."""
        self._receiving = None

    def plan(self, kind: PlanKind) -> list[Item]:
        return self.items[kind]

    def load(self, kind: PlanKind, items: list[Item]) -> None:
        self.items[kind] = list(items)

    def _ask(self) -> None:
        assert self._receiving is not None
        kind, wanted, _ = self._receiving
        self._asked_s = self.now_s
        self._send(mavlink.MAVLink_mission_request_int_message(*self._peer, wanted, kind.mission_type))

    def _ack(self, kind: PlanKind, result: int) -> None:
        self._send(mavlink.MAVLink_mission_ack_message(*self._peer, result, kind.mission_type))


class Line:
    """Agent and autopilot, in steps of 10 ms. `to_server`, `to_agent`: the line's faults."""

    def __init__(self, server: Callable[[Callable[[Message], None]], Any], *, home_slot: bool = True) -> None:
        self.now = 100.0
        self.home_slot = home_slot
        self.journal = MemoryJournal()
        self.server = server(self._server_says)
        self.server.now_s = self.now
        self.to_server: Fault = lambda _number, _message: 1
        self.to_agent: Fault = lambda _number, _message: 1
        self.silent_until = 0.0
        self.reports: list[Any] = []
        self.on_step: Callable[[], None] = lambda: None
        self._agent_codec, self._server_codec = Codec(1, 191), Codec(1, 1)
        self._down: list[bytes] = []
        self._counts = {"up": 0, "down": 0}
        self._id = 0
        self.start_agent()

    def start_agent(self) -> None:
        """Starts the agent, also after a kill: only the journal is left."""
        self._down.clear()
        self.handler = PlanHandler(FrameMaker(), self.journal, RetryPolicy())
        keeping = ArduPilot() if self.home_slot else Px4()
        self.handler.autopilot_came(vehicle_system_id=1, home_slot=self.home_slot, keeping=keeping, now=self.now)

    def _server_says(self, message: Message) -> None:
        self._counts["down"] += 1
        if self.now >= self.silent_until:
            frame = self._server_codec.encode(message)
            self._down += [frame] * self.to_agent(self._counts["down"], message)

    def step(self) -> None:
        self.now += STEP_S
        self.server.now_s = self.now
        heard, self._down = self._down, []
        frames = []
        for frame in heard:
            self.handler.receive(frame, self.now)
            frames += self.handler.due(self.now)
        frames += self.handler.due(self.now)
        self.reports += self.handler.reports()
        for frame in frames:
            (message,) = self._agent_codec.decode(frame)
            self._counts["up"] += 1
            for _ in range(self.to_server(self._counts["up"], message)):
                if self.now >= self.silent_until:
                    self.server.receive(message, (1, 191))
        self.server.tick()
        self.on_step()

    def begin(self, work: Any, *, epoch: int = 1, deadline_s: float = 120.0) -> int:
        self._id += 1
        self.handler.begin(Transaction(id=self._id, epoch=epoch, deadline_s=deadline_s, work=work), self.now)
        self.reports += self.handler.reports()
        return self._id

    def result(self, limit_s: float = 120.0) -> TransactionResult:
        """Returns the result of the latest transaction."""
        until = self.now + limit_s
        while self.now < until:
            for reported in self.reports:
                if isinstance(reported, TransactionResult) and reported.id == self._id:
                    return reported
            self.step()
        raise AssertionError("no result")

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / STEP_S)):
            self.step()

    def do(self, work: Any, **options: Any) -> TransactionResult:
        self.begin(work, **options)
        return self.result()

    def upload(self, plan: Plan, kind: PlanKind = PlanKind.MISSION) -> TransactionResult:
        return self.do(PlanUploadWork(kind, plan))

    def load(self, plan: Plan, kind: PlanKind = PlanKind.MISSION) -> None:
        """Loads a plan straight into the autopilot."""
        items = [Item(i.command, i.frame, tuple(p or 0.0 for p in i.params), i.x, i.y, i.z, 1) for i in plan]
        if self.home_slot and kind is PlanKind.MISSION:
            items.insert(0, Item(16, 0, x=473977420, y=85455940, z=488.0))
        self.server.load(kind, items)

    def on_board(self, kind: PlanKind = PlanKind.MISSION) -> Plan:
        """Returns the plan that the autopilot would fly."""
        items = self.server.plan(kind)
        if self.home_slot and kind is PlanKind.MISSION:
            items = items[1:]
        return tuple(PlanItem(i.command, int(i.frame), i.params, i.x, i.y, i.z, i.autocontinue) for i in items)

    def reported(self, what: type) -> list[Any]:
        return [one for one in self.reports if isinstance(one, what)]


__all__ = [
    "NEW",
    "OLD",
    "Failure",
    "InPlaceServer",
    "Killed",
    "Line",
    "Outcome",
    "PlanClearWork",
    "PlanDownloadWork",
    "PlanOnBoard",
    "PlanUploadWork",
    "PlanVerifyWork",
    "SimulatorServer",
    "TransactionProgress",
    "waypoints",
]
