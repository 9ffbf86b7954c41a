"""Messages to the autopilot about one plan, and its item numbering. Pure.

Users and the tower number items from 0, without home. ArduPilot keeps home in slot 0 of a mission, so its item
numbers, and the targets of jumps, are one higher.
"""

from typing import Any, Final

import msgspec

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender
from wire.dialect import mavlink
from wire.plan_fields import KeptFields
from wire.plan_keeping import to_send
from wire.plans import Plan, PlanItem, PlanKind, item_message

_AUTOPILOT_COMPONENT: Final = 1
ASKED_AHEAD: Final = 5
"""For ArduPilot, which answers each item request by itself. On a serial line of 57,600 baud that is 45 ms."""
FENCE_SETTLES_S: Final = 0.5
"""If ArduPilot (AC_PolyFence_loader of 4.7-dev) receives a fence of fewer than three corners and circles after a larger
one, it takes that for an old ground station's clearing. It drops the fence at its next check, ten times a second."""

_HOME_PLACEHOLDER: Final = PlanItem(mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_FRAME_GLOBAL)
"""Sent as slot 0; the autopilot replaces it by its home."""


class PlanFrames:
    """Makes the frames of one kind of plan for one vehicle. `home_slot`: slot 0 of its missions is home."""

    def __init__(
        self, kind: PlanKind, maker: FrameMaker, *, vehicle_system_id: int, home_slot: bool, keeping: KeptFields
    ) -> None:
        self.kind = kind
        self.keeping = keeping
        """Which fields of a plan's items the autopilot keeps."""
        self._maker = maker
        self._system = vehicle_system_id
        self.first = 1 if home_slot and kind is PlanKind.MISSION else 0
        """The autopilot's number of item 0."""
        self.asks_ahead = ASKED_AHEAD if home_slot else 1
        """Maximum items requested at the same time. PX4 sends them one after another."""
        self.settle_s = FENCE_SETTLES_S if home_slot and kind is PlanKind.FENCE else 0.0
        """How long after a write a read-back may differ from the final plan."""

    def to_board(self, plan: Plan) -> Plan:
        """Converts a plan to the autopilot's numbering and to the best form for sending."""
        plan = to_send(self.keeping, self.kind, plan)
        if not self.first:
            return plan
        return (_HOME_PLACEHOLDER, *(_jump_moved(item, 1) for item in plan))

    def from_board(self, items: Plan) -> Plan:
        """Converts items from the autopilot to a plan."""
        if not self.first:
            return items
        return tuple(_jump_moved(item, -1) for item in items[1:])

    def ask_count(self) -> bytes:
        """MISSION_REQUEST_LIST."""
        return self._frame(mavlink.MAVLink_mission_request_list_message(*self._target, self._type))

    def ask_item(self, seq: int) -> bytes:
        """MISSION_REQUEST_INT."""
        return self._frame(mavlink.MAVLink_mission_request_int_message(*self._target, seq, self._type))

    def offer(self, count: int) -> bytes:
        """MISSION_COUNT, which starts an upload."""
        return self._frame(mavlink.MAVLink_mission_count_message(*self._target, count, self._type))

    def item(self, seq: int, item: PlanItem) -> bytes:
        """MISSION_ITEM_INT."""
        made = item_message(
            item, seq=seq, kind=self.kind, target_system=self._system, target_component=_AUTOPILOT_COMPONENT
        )
        return self._frame(made)

    def clear(self) -> bytes:
        """MISSION_CLEAR_ALL for this kind only."""
        return self._frame(mavlink.MAVLink_mission_clear_all_message(*self._target, self._type))

    def acknowledge(self, result: int) -> bytes:
        """MISSION_ACK: a download is complete, or abandoned."""
        return self._frame(mavlink.MAVLink_mission_ack_message(*self._target, result, self._type))

    def concerns(self, message: Any) -> bool:
        """Whether a mission-protocol message is about this kind of plan."""
        return bool(getattr(message, "mission_type", 0) == self._type)

    @property
    def _type(self) -> int:
        return self.kind.mission_type

    @property
    def _target(self) -> tuple[int, int]:
        return self._system, _AUTOPILOT_COMPONENT

    def _frame(self, message: Any) -> bytes:
        return self._maker.make(message, agent_sender(self._system))


def _jump_moved(item: PlanItem, by: int) -> PlanItem:
    target = item.params[0]
    if item.command != mavlink.MAV_CMD_DO_JUMP or target is None:
        return item
    return msgspec.structs.replace(item, params=(target + by, *item.params[1:]))
