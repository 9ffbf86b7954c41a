"""The server half of the mission protocol, for missions, fences and rally points.

An upload is collected beside the stored plan and takes its place only when it is whole, so that one which fails
half-way leaves the old plan as it was. One upload at a time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from simulator.auto import Auto
from simulator.dialect import Message, mavlink
from simulator.failure_modes import Failure
from simulator.flight import Flight
from simulator.mission_plan import Item, PlanKind
from simulator.notices import Severity

ITEMS_MAX = 724
REPEAT_S = 1.0
UPLOAD_TIMEOUT_S = 8.0

ACCEPTED = mavlink.MAV_MISSION_ACCEPTED
FRAMES = frozenset({0, 2, 3, 5, 6, 10, 11})
COMMANDS = frozenset(
    {16, 17, 18, 19, 20, 21, 22, 82, 93, 112, 114, 115, 177, 178, 179, 181, 183, 184, 189, 195, 197, 201, 205}
    | {206, 211, 212, 222, 2000, 2001, 2500, 2501}
)
FENCE_COMMANDS = frozenset(range(5000, 5005))
RALLY_COMMANDS = frozenset({5100})
KNOWN_COMMANDS = {
    PlanKind.MISSION: COMMANDS,
    PlanKind.FENCE: FENCE_COMMANDS,
    PlanKind.RALLY: RALLY_COMMANDS,
}

Peer = tuple[int, int]
"""System and component of whoever we talk with."""


@dataclass(slots=True)
class Upload:
    peer: Peer
    kind: PlanKind
    count: int
    last_heard_s: float
    asked_s: float
    items: list[Item] = field(default_factory=list)


class MissionServer:
    def __init__(self, flight: Flight, send: Callable[[Message], None]) -> None:
        self._flight = flight
        self._send = send
        self._upload: Upload | None = None
        self._ignored: set[str] = set()

    def receive(self, message: Message, peer: Peer) -> None:
        name = message.get_type()
        if name == "MISSION_ACK":
            return
        kind = plan_kind(message.mission_type)
        if name == "MISSION_CLEAR_ALL":
            self._clear(message.mission_type, peer)
        elif kind is None:
            self._ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)
        elif name == "MISSION_COUNT":
            self._begin_upload(kind, message.count, peer)
        elif name == "MISSION_REQUEST_LIST":
            self._count(kind, peer)
        elif name in ("MISSION_REQUEST", "MISSION_REQUEST_INT"):
            self._give(kind, message.seq, peer, whole_numbers=name.endswith("INT"))
        elif name in ("MISSION_ITEM", "MISSION_ITEM_INT"):
            self._take(message, kind, peer)
        else:
            self._ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)

    def tick(self) -> None:
        upload, now_s = self._upload, self._flight.now_s
        if upload is None:
            return
        if now_s - upload.last_heard_s >= UPLOAD_TIMEOUT_S:
            self._upload = None
            self._flight.say(Severity.NOTICE, "Mission upload timeout")
            self._ack(upload.peer, mavlink.MAV_MISSION_OPERATION_CANCELLED, upload.kind)
        elif now_s - upload.asked_s >= REPEAT_S:
            self._ask_next(upload)

    def _ignores(self, step: str) -> bool:
        """The first of each step, where that failure is switched on."""
        if Failure.FIRST_MISSION_REQUEST_IGNORED not in self._flight.failures or step in self._ignored:
            return False
        self._ignored.add(step)
        return True

    def _begin_upload(self, kind: PlanKind, count: int, peer: Peer) -> None:
        if self._ignores("count"):
            return
        if self._upload is not None and self._upload.peer != peer:
            self._ack(peer, mavlink.MAV_MISSION_DENIED, kind)
        elif count > ITEMS_MAX or Failure.MISSION_FULL in self._flight.failures:
            self._ack(peer, mavlink.MAV_MISSION_NO_SPACE, kind)
        else:
            now_s = self._flight.now_s
            self._upload = Upload(peer, kind, count, now_s, now_s)
            if count == 0:
                self._finish(self._upload)
            else:
                self._ask_next(self._upload)

    def _ask_next(self, upload: Upload) -> None:
        upload.asked_s = self._flight.now_s
        old = Failure.OLD_MISSION_REQUESTS in self._flight.failures
        ask = mavlink.MAVLink_mission_request_message if old else mavlink.MAVLink_mission_request_int_message
        self._send(ask(*upload.peer, len(upload.items), int(upload.kind)))

    def _take(self, message: Message, kind: PlanKind, peer: Peer) -> None:
        upload = self._upload
        if upload is None or upload.peer != peer or upload.kind is not kind:
            self._ack(peer, mavlink.MAV_MISSION_ERROR, kind)
            return
        if message.seq != len(upload.items):
            if message.seq > len(upload.items):
                self._ack(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE, kind)
            return  # one that came twice is no error
        upload.last_heard_s = self._flight.now_s
        item = read_item(message)
        problem = why_not(item, kind)
        if problem is not None:
            self._upload = None
            self._ack(peer, problem, kind)
            return
        upload.items.append(item)
        if len(upload.items) == upload.count:
            self._finish(upload)
        else:
            self._ask_next(upload)

    def _finish(self, upload: Upload) -> None:
        self._upload = None
        self._flight.plans.store(upload.kind, upload.items, self._flight.home)
        if Failure.MISSION_FINAL_ACK_MISSING not in self._flight.failures:
            self._ack(upload.peer, ACCEPTED, upload.kind)

    def _count(self, kind: PlanKind, peer: Peer) -> None:
        if self._ignores("list"):
            return
        count = len(self._flight.plans.items[kind])
        self._send(mavlink.MAVLink_mission_count_message(*peer, count, int(kind)))

    def _give(self, kind: PlanKind, seq: int, peer: Peer, *, whole_numbers: bool) -> None:
        if self._ignores("request"):
            return
        items = self._flight.plans.items[kind]
        if seq >= len(items):
            self._ack(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE, kind)
            return
        item = items[seq]
        current = int(kind is PlanKind.MISSION and seq == self._flight.plans.current)
        fields = (*peer, seq, int(item.frame), item.command, current, item.autocontinue, *item.params)
        if whole_numbers:
            made = mavlink.MAVLink_mission_item_int_message(*fields, item.x, item.y, item.z, int(kind))
        else:
            place = (item.x * 1e-7, item.y * 1e-7)
            made = mavlink.MAVLink_mission_item_message(*fields, *place, item.z, int(kind))
        self._send(made)

    def _clear(self, mission_type: int, peer: Peer) -> None:
        flight = self._flight
        kinds = list(PlanKind) if mission_type == 255 else [plan_kind(mission_type)]
        if None in kinds:
            self._ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, mission_type)
            return
        if PlanKind.MISSION in kinds and flight.armed and isinstance(flight.flying, Auto):
            self._ack(peer, mavlink.MAV_MISSION_ERROR, mission_type)
            return
        for kind in kinds:
            if kind is not None:
                flight.plans.store(kind, [], flight.home)
        self._ack(peer, ACCEPTED, mission_type)

    def _ack(self, peer: Peer, result: int, mission_type: int) -> None:
        self._send(mavlink.MAVLink_mission_ack_message(*peer, result, int(mission_type)))


def plan_kind(mission_type: int) -> PlanKind | None:
    return PlanKind(mission_type) if mission_type in (0, 1, 2) else None


def read_item(message: Message) -> Item:
    if message.get_type() == "MISSION_ITEM":
        x, y = (round(v * 1e7) if math.isfinite(v) and abs(v) < 200 else 2**31 - 1 for v in (message.x, message.y))
    else:
        x, y = message.x, message.y
    raw = (message.param1, message.param2, message.param3, message.param4)
    params = tuple(0.0 if math.isnan(value) else value for value in raw)
    return Item(
        message.command,
        message.frame,
        (params[0], params[1], params[2], params[3]),
        x,
        y,
        message.z,
        message.autocontinue,
    )


def why_not(item: Item, kind: PlanKind) -> int | None:
    """The MAV_MISSION_RESULT with which an item is refused, or None."""
    if item.command not in KNOWN_COMMANDS[kind]:
        return int(mavlink.MAV_MISSION_UNSUPPORTED)
    if item.frame not in FRAMES:
        return int(mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    for number, value in enumerate(item.params):
        if not math.isfinite(value):
            return int(mavlink.MAV_MISSION_INVALID_PARAM1) + number
    if abs(item.x) > 900_000_000:
        return int(mavlink.MAV_MISSION_INVALID_PARAM5_X)
    if abs(item.y) > 1_800_000_000:
        return int(mavlink.MAV_MISSION_INVALID_PARAM6_Y)
    if not math.isfinite(item.z) or abs(item.z) > 50_000:
        return int(mavlink.MAV_MISSION_INVALID_PARAM7)
    return None
