"""Whether another program changed a plan on board, or exchanges plans with the autopilot. No I/O.

Rules, each tested:

- Another program's upload through the tower may have changed the plan from its first frame on.
- An upload that the autopilot acknowledges to another program has changed it.
- So has one after which MISSION_CURRENT shows another number of items, or another id, than after our own last read.
"""

from struct import Struct
from typing import Final

from wire.dialect import decode, mavlink
from wire.frames import message_id, payload
from wire.plans import PlanKind

QUIET_S: Final = 3.0
"""Ground stations repeat themselves after 1.5 s: after this much silence a transfer has ended, or was given up."""

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
# The identities are younger than the dialect that is installed: seq, total, mission_state, mission_mode, then three.
_CURRENT: Final = Struct("<HHBBIII")


class PlanChanges:
    """Tell it what passes; take what may have changed with `take`."""

    def __init__(self) -> None:
        self._changed: set[PlanKind] = set()
        self._talked_at = float("-inf")
        self._current: dict[PlanKind, int] = {}
        """MISSION_CURRENT's report since our own last read."""

    def quiet(self, now: float) -> bool:
        """Whether no other program exchanges plans with the autopilot."""
        return now - self._talked_at >= QUIET_S

    def checked(self, kind: PlanKind) -> None:
        """We have just read this plan, perhaps after writing it: what MISSION_CURRENT tells next belongs to it."""
        self._current.pop(kind, None)
        self._changed.discard(kind)

    def pop(self) -> set[PlanKind]:
        """Kinds that may have changed since the last call."""
        changed, self._changed = self._changed, set()
        return changed

    def from_ground_station(self, frame: bytes, now: float) -> None:
        """One of TALK passes on its way to the autopilot."""
        self._talked_at = now
        if message_id(frame) in _BEGINS_TO_WRITE:
            self._note(frame)

    def from_autopilot(self, frame: bytes, now: float) -> None:
        """One of TALK, or MISSION_CURRENT, came from the autopilot, not for us."""
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
