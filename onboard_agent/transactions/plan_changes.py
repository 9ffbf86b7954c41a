"""Detects plan changes by others, and plan transfers between others and the autopilot. No I/O.

Rules, each tested:
- A client that begins to write a plan through the tower may have changed it from that moment on.
- An upload that the autopilot acknowledges to another client has changed the plan.
- So has a MISSION_CURRENT whose item count or id differs from the first one after our own last reading.
"""

from struct import Struct
from typing import Final

from wire.dialect import decode, mavlink
from wire.frames import message_id, payload
from wire.plans import PlanKind

QUIET_S: Final = 3.0
"""Ground stations retry after 1.5 s: after this silence a transfer is over, or given up."""

_ID: Final = "MAVLINK_MSG_ID_MISSION_"
_FENCE_POINT: Final = mavlink.MAVLINK_MSG_ID_FENCE_POINT
_RALLY_POINT: Final = mavlink.MAVLINK_MSG_ID_RALLY_POINT
_MISSION_CURRENT: Final = mavlink.MAVLINK_MSG_ID_MISSION_CURRENT
_MISSION_ACK: Final = mavlink.MAVLINK_MSG_ID_MISSION_ACK

_BEGINS_TO_WRITE: Final = frozenset(
    {getattr(mavlink, f"{_ID}{name}") for name in ("COUNT", "CLEAR_ALL", "WRITE_PARTIAL_LIST")}
    | {_FENCE_POINT, _RALLY_POINT}
)
TALK: Final = _BEGINS_TO_WRITE | {
    getattr(mavlink, f"{_ID}{name}")
    for name in ("ACK", "ITEM", "ITEM_INT", "REQUEST", "REQUEST_INT", "REQUEST_LIST", "REQUEST_PARTIAL_LIST")
}
"""Messages of the mission protocol, in both directions."""

_ALL: Final = 255
# The ids are newer than the installed dialect: seq, total, mission_state, mission_mode, then three ids.
_CURRENT: Final = Struct("<HHBBIII")


class PlanChanges:
    """Feed it the passing messages; `pop` returns the kinds that may have changed."""

    def __init__(self) -> None:
        self._changed: set[PlanKind] = set()
        self._talked_at = float("-inf")
        self._current: dict[PlanKind, int] = {}
        """Contents of MISSION_CURRENT since our own last reading."""

    def quiet(self, now: float) -> bool:
        """Whether no other client is exchanging plans with the autopilot."""
        return now - self._talked_at >= QUIET_S

    def checked(self, kind: PlanKind) -> None:
        """We have just read this plan, perhaps after writing it: the next MISSION_CURRENT belongs to it."""
        self._current.pop(kind, None)
        self._changed.discard(kind)

    def pop(self) -> set[PlanKind]:
        """Returns the kinds that may have changed since the last call."""
        changed, self._changed = self._changed, set()
        return changed

    def from_ground_station(self, frame: bytes, now: float) -> None:
        """Takes a message of TALK on its way to the autopilot."""
        self._talked_at = now
        if message_id(frame) in _BEGINS_TO_WRITE:
            self._note(frame)

    def from_autopilot(self, frame: bytes, now: float) -> None:
        """Takes a message of TALK, or MISSION_CURRENT, from the autopilot that is not addressed to the agent."""
        msgid = message_id(frame)
        if msgid == _MISSION_CURRENT:
            self._read_current(frame)
            return
        self._talked_at = now
        if msgid == _MISSION_ACK:
            message = decode(frame)
            if message is not None and message.type == mavlink.MAV_MISSION_ACCEPTED:
                self._note(frame)

    def _note(self, frame: bytes) -> None:
        msgid = message_id(frame)
        if msgid in (_FENCE_POINT, _RALLY_POINT):
            self._changed.add(PlanKind.FENCE if msgid == _FENCE_POINT else PlanKind.RALLY)
            return
        message = decode(frame)
        mission_type = getattr(message, "mission_type", 0)
        self._changed |= {kind for kind in PlanKind if mission_type in (_ALL, kind.mission_type)}

    def _read_current(self, frame: bytes) -> None:
        _, total, _, _, mission_id, fence_id, rally_id = _CURRENT.unpack_from(
            payload(frame).ljust(_CURRENT.size, b"\0")
        )
        ids = {PlanKind.MISSION: mission_id << 16 | total, PlanKind.FENCE: fence_id, PlanKind.RALLY: rally_id}
        for kind, number in ids.items():
            if self._current.setdefault(kind, number) != number:
                self._current[kind] = number
                self._changed.add(kind)
