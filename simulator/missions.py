"""The server half of the mission protocol, for missions, fences and rally points.

An upload is collected separately from the stored plan and replaces it only when complete, so an upload that fails
half-way leaves the old plan intact (unless the failure that writes plans in place is active). One upload at a time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from simulator.auto import Auto
from simulator.dialect import Message, mavlink
from simulator.failure_modes import Failure
from simulator.flavour import Flavour
from simulator.flight import Flight
from simulator.mission_items import read_item
from simulator.mission_plan import Item, PlanKind
from simulator.notices import Severity

REPEAT_S = 1.0
UPLOAD_TIMEOUT_S = 8.0
CHECK_FENCE_S = 0.1

ACCEPTED = mavlink.MAV_MISSION_ACCEPTED
Peer = tuple[int, int]
"""System and component of the peer."""


@dataclass(slots=True)
class Upload:
    peer: Peer
    kind: PlanKind
    count: int
    last_heard_s: float
    asked_s: float
    items: list[Item] = field(default_factory=list)
    in_place: bool = False
    asked_wrongly: bool = False

    @property
    def half_way(self) -> bool:
        return len(self.items) == (self.count + 1) // 2


class MissionServer:
    def __init__(
        self,
        flight: Flight,
        flavour: Flavour,
        send: Callable[[Message], None],
        restart: Callable[[], None] = lambda: None,
    ) -> None:
        self._flavour = flavour
        self._flight = flight
        self._send = send
        self._restart = restart
        self._upload: Upload | None = None
        self._ignored: set[str] = set()
        self._fence_total = 0
        self._fence_seen_s = 0.0

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
            self._send_item(kind, message.seq, peer, whole_numbers=name.endswith("INT"))
        elif name in ("MISSION_ITEM", "MISSION_ITEM_INT"):
            self._receive_item(message, kind, peer)
        else:
            self._ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)

    def _check_fence(self) -> None:
        now_s, plans = self._flight.now_s, self._flight.plans
        if now_s < self._fence_seen_s + CHECK_FENCE_S:
            return
        self._fence_seen_s = now_s
        items = plans.items[PlanKind.FENCE]
        total = self._flavour.storage.fence_total(items)
        if total == 0 and self._fence_total != 0 and items:
            plans.store(PlanKind.FENCE, [], self._flight.home)
        self._fence_total = total

    def tick(self) -> None:
        self._check_fence()
        upload, now_s = self._upload, self._flight.now_s
        if upload is None:
            return
        if now_s - upload.last_heard_s >= UPLOAD_TIMEOUT_S:
            self._upload = None
            self._flight.notify(Severity.NOTICE, "Mission upload timeout")
            self._ack(upload.peer, mavlink.MAV_MISSION_OPERATION_CANCELLED, upload.kind)
        elif now_s - upload.asked_s >= REPEAT_S:
            self._ask_next(upload)

    def _fails(self, failure: Failure) -> bool:
        return failure in self._flight.failures

    def _ignores(self, step: str) -> bool:
        """Ignores the first message of each step while that failure is active."""
        if not self._fails(Failure.FIRST_MISSION_REQUEST_IGNORED) or step in self._ignored:
            return False
        self._ignored.add(step)
        return True

    def _begin_upload(self, kind: PlanKind, count: int, peer: Peer) -> None:
        if self._ignores("count"):
            return
        if self._upload is not None and self._upload.peer != peer:
            self._ack(peer, mavlink.MAV_MISSION_DENIED, kind)
        elif count > self._flavour.items_max[kind] or self._fails(Failure.MISSION_FULL):
            self._ack(peer, mavlink.MAV_MISSION_NO_SPACE, kind)
        else:
            now_s = self._flight.now_s
            in_place = kind is not PlanKind.FENCE and self._fails(Failure.MISSION_WRITTEN_IN_PLACE)
            self._upload = Upload(peer, kind, count, now_s, now_s, in_place=in_place)
            if in_place:
                self._flight.plans.begin_in_place(kind, count)
            if count == 0:
                self._finish(self._upload)
            else:
                self._ask_next(self._upload)

    def _ask_next(self, upload: Upload) -> None:
        upload.asked_s = self._flight.now_s
        seq = len(upload.items)
        if self._fails(Failure.MISSION_WRONG_SEQUENCE) and upload.half_way and not upload.asked_wrongly:
            upload.asked_wrongly = True
            seq += 1
        ask = (
            mavlink.MAVLink_mission_request_message
            if self._fails(Failure.OLD_MISSION_REQUESTS)
            else mavlink.MAVLink_mission_request_int_message
        )
        for _ in range(2 if self._fails(Failure.MISSION_REQUESTS_TWICE) else 1):
            self._send(ask(*upload.peer, seq, int(upload.kind)))

    def _receive_item(self, message: Message, kind: PlanKind, peer: Peer) -> None:
        upload = self._upload
        if upload is None or upload.peer != peer or upload.kind is not kind:
            self._ack(peer, mavlink.MAV_MISSION_ERROR, kind)
            return
        if message.seq != len(upload.items):
            if upload.asked_wrongly and upload.half_way:
                self._ask_next(upload)
            elif message.seq > len(upload.items):
                self._ack(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE, kind)
            return  # a duplicate is no error
        upload.last_heard_s = self._flight.now_s
        storage, sent = self._flavour.storage, read_item(message)
        taken = storage.accept(sent, kind)
        if isinstance(taken, Item) and (problem := storage.why_not_jump(taken, upload.count - 1)) is not None:
            taken = problem
        if not isinstance(taken, Item):
            self._upload = None
            self._ack(peer, taken, kind)
            return
        item = sent if self._fails(Failure.MISSION_VERBATIM) else taken
        upload.items.append(item)
        if upload.in_place:
            self._flight.plans.write_in_place(kind, message.seq, item, self._flight.home)
        ends_early = upload.half_way and self._fails(Failure.MISSION_ENDS_EARLY)
        if len(upload.items) == upload.count or ends_early:
            self._finish(upload)
        elif upload.half_way and self._fails(Failure.REBOOT_DURING_UPLOAD) and not self._flight.armed:
            self._flight.failures.discard(Failure.REBOOT_DURING_UPLOAD)
            self._upload = None
            self._restart()
        else:
            self._ask_next(upload)

    def _finish(self, upload: Upload) -> None:
        self._upload = None
        problem = self._flavour.storage.why_not_whole(upload.items, upload.kind)
        if problem is not None:
            self._ack(upload.peer, problem, upload.kind)
            return
        self._flight.plans.store(upload.kind, upload.items, self._flight.home)
        if self._fails(Failure.MISSION_FINAL_ACK_MISSING):
            return
        for _ in range(2 if self._fails(Failure.MISSION_REQUESTS_TWICE) else 1):
            self._ack(upload.peer, ACCEPTED, upload.kind)

    def _count(self, kind: PlanKind, peer: Peer) -> None:
        if self._ignores("list"):
            return
        count = len(self._flight.plans.items[kind])
        self._send(mavlink.MAVLink_mission_count_message(*peer, count, int(kind)))

    def _send_item(self, kind: PlanKind, seq: int, peer: Peer, *, whole_numbers: bool) -> None:
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
