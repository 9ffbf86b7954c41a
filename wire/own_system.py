"""Which vehicle a line is about when several share it. No I/O.

One judgement for the agent's port, for the tower's live frames, and for recordings and imports: a value of another
vehicle that passes once is a wrong battery, a wrong place, or a command to a machine that nobody can hold.
"""

from collections.abc import Iterable
from struct import calcsize
from typing import Any, Final

from wire.dialect import mavlink
from wire.frames import MAGIC_V2, message_id, payload, source
from wire.ids import SystemId

SILENT_S: Final = 5.0
"""Silence of the drone's own autopilot after which another system may be it, under a new system id."""

OTHER_FOR_S: Final = 10.0
"""Another autopilot counts as on the line for this long after its last heartbeat."""

_AUTOPILOT: Final = mavlink.MAV_COMP_ID_AUTOPILOT1
_HEARTBEAT: Final = mavlink.MAVLINK_MSG_ID_HEARTBEAT
_TYPE, _AUTOPILOT_KIND = 4, 5
"""Offsets in a HEARTBEAT. Its last byte is never zero, so its payload is complete."""

_OF_RADIOS: Final = frozenset({mavlink.MAVLINK_MSG_ID_RADIO_STATUS, mavlink.MAVLINK_MSG_ID_RADIO})
"""Telemetry radios report about the line under a system id of their own."""

OF_AUTOPILOT_ALONE: Final = frozenset(
    {
        mavlink.MAVLINK_MSG_ID_SYS_STATUS,
        mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
        mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
        mavlink.MAVLINK_MSG_ID_HOME_POSITION,
        mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
        mavlink.MAVLINK_MSG_ID_MISSION_CURRENT,
        mavlink.MAVLINK_MSG_ID_MISSION_ITEM_REACHED,
        mavlink.MAVLINK_MSG_ID_FENCE_STATUS,
        mavlink.MAVLINK_MSG_ID_VFR_HUD,
        mavlink.MAVLINK_MSG_ID_ALTITUDE,
        mavlink.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT,
        mavlink.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT,
        mavlink.MAVLINK_MSG_ID_HIGH_LATENCY,
        mavlink.MAVLINK_MSG_ID_HIGH_LATENCY2,
        mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT,
        mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS,
    }
)
"""What these say of the vehicle counts only from its autopilot: a companion computer or a second position source sends
them too, and means itself."""


def is_autopilot_heartbeat(frame: bytes) -> bool:
    """Whether a whole frame is the heartbeat of a vehicle's autopilot."""
    if message_id(frame) != _HEARTBEAT or source(frame)[1] != _AUTOPILOT:
        return False
    body = payload(frame)
    return (
        len(body) > _AUTOPILOT_KIND
        and body[_AUTOPILOT_KIND] != mavlink.MAV_AUTOPILOT_INVALID
        and body[_TYPE] != mavlink.MAV_TYPE_GCS
    )


class OwnSystem:
    """Feed it every frame of one line, in order.

    The first autopilot that is heard is the drone's own. Another one becomes it only after SILENT_S, when a system id
    was changed: never one that was heard beside it. `only`: the system id is given. `remembered`: the own one of the
    previous process, which is waited for. `neighbours`: others that are drones of their own. `judged`: an agent has
    judged these frames, as far as it was new enough; so any frame of an autopilot tells the own system, and until then
    all pass.
    """

    def __init__(
        self,
        *,
        only: int | None = None,
        remembered: int | None = None,
        neighbours: Iterable[int] = (),
        judged: bool = False,
        now: float = 0.0,
    ) -> None:
        first = remembered if only is None else only
        self.system_id = None if first is None else SystemId(first)
        self._is_fixed = only is not None
        self._is_judged = judged
        self._neighbours = frozenset(neighbours)
        self._heard_at = now
        self._others: dict[int, float] = {}
        """When each other autopilot was heard last."""
        self._told_others: tuple[int, ...] = ()
        self._beside: set[int] = set()
        """Other autopilots that were heard while the own one was."""

    @property
    def is_fixed(self) -> bool:
        """Whether no other system id can become its own."""
        return self._is_fixed

    def told(self, system_id: int, others: tuple[int, ...]) -> None:
        """The agent says which one it is, and which others are on its line. 0: it does not say."""
        self._told_others = others
        self._is_fixed = system_id > 0
        if self._is_fixed:
            self.system_id = SystemId(system_id)

    def counts(self, frame: bytes, now: float) -> bool:
        """Whether a whole frame is of this drone. `now`: of any clock that does not go back."""
        # Runs for every frame: nearly all are of the drone's own autopilot, alone on its line.
        if frame[5] == self.system_id and frame[6] == _AUTOPILOT and frame[0] == MAGIC_V2 and not self._others:
            self._heard_at = now
            return True
        system_id, component_id = source(frame)
        if component_id == _AUTOPILOT and message_id(frame) == _HEARTBEAT:
            self._heartbeat(system_id, frame, now)
        if self.system_id is None and self._is_judged:
            if component_id == _AUTOPILOT and message_id(frame) != _HEARTBEAT:
                self.system_id = SystemId(system_id)
            else:
                return True
        if system_id != self.system_id:
            return message_id(frame) in _OF_RADIOS
        if component_id == _AUTOPILOT:
            self._heard_at = now
            return True
        return message_id(frame) not in OF_AUTOPILOT_ALONE

    def others(self, now: float) -> tuple[int, ...]:
        """System ids of the other autopilots on the line: those that are heard beside the own one."""
        if not self._beside and not self._told_others:
            return ()
        heard = {one for one in self._beside if one != self.system_id and now - self._others[one] < OTHER_FOR_S}
        return tuple(sorted(heard.union(self._told_others)))

    def strangers(self, now: float) -> tuple[int, ...]:
        """Those of the others that are no drones of their own: nobody can fly or hold them."""
        return tuple(one for one in self.others(now) if one not in self._neighbours)

    def may_take(self, frame: bytes, now: float) -> bool:
        """Whether a whole frame may go to the drone: what names another vehicle may not, nor what names all of them
        while there is another."""
        target = target_system(frame)
        if target is None or self.system_id in (None, target):
            return True
        return target == 0 and not self.others(now)

    def _heartbeat(self, system_id: int, frame: bytes, now: float) -> None:
        if not is_autopilot_heartbeat(frame):
            return
        if system_id == self.system_id:
            self._beside.update(self._others)
            return
        is_own_gone = self.system_id is None or now - self._heard_at >= SILENT_S
        if is_own_gone and not self._is_fixed and system_id not in self._beside:
            self.system_id = SystemId(system_id)
            self._beside.clear()
        else:
            self._others[system_id] = now


def target_system(frame: bytes) -> int | None:
    """The system that a whole frame is addressed to, 0: all; None if its message has no addressee."""
    offset = target_offset(frame)
    if offset is None:
        return None
    body = payload(frame)
    return body[offset] if offset < len(body) else 0  # version 2 leaves trailing zeros out


def target_offset(frame: bytes) -> int | None:
    """Where in its payload a whole frame names the system that it is addressed to; None: its message names none."""
    return _TARGETS.get(message_id(frame))


def _offset_of_target(message: Any) -> int | None:
    at = 0
    for name, kind, count in zip(message.ordered_fieldnames, _kinds(message), message.array_lengths, strict=True):
        if name in ("target_system", "target"):
            return at
        at += calcsize(f"<{kind}") * max(1, count)
    return None


def _kinds(message: Any) -> str:
    return bytes(message.native_format).decode().removeprefix("<")


_TARGETS: Final = {
    msgid: offset for msgid, one in mavlink.mavlink_map.items() if (offset := _offset_of_target(one)) is not None
}
"""Message id to the offset of its addressee."""
