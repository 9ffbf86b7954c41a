"""When the drone holds, and what is done when the tower stays lost: joins the watches, the hold and the lost action.

No I/O; takes `now`. Each part has its own laws in its own file; here is only who is told what, and in which order.
"""

import logging
from typing import Any, Final

from onboard_agent.autopilot_state import AutopilotView
from onboard_agent.downlink import Downlink
from onboard_agent.flight_modes import FlightMode, Modes, hold_rungs, modes_of
from onboard_agent.hold import Hold
from onboard_agent.holder import Holder
from onboard_agent.inquiry import Inquiry
from onboard_agent.lost_action import Loss, LostActing
from onboard_agent.lost_action_table import Deed
from onboard_agent.own_frames import FrameMaker
from onboard_agent.pilot_watch import PilotWatch
from wire.control_messages import HoldCause, SafetySettings

_log = logging.getLogger(__name__)

SAME_CHANGE_S: Final = 2.0
"""A hold that is ordered this soon after the epoch has grown belongs to the change of hands."""


class Failsafe:
    """Ask `look` at each tick, and `due` for what is to be sent at each tick and after whatever changed a mode."""

    def __init__(
        self,
        maker: FrameMaker,
        *,
        autopilot: AutopilotView,
        downlink: Downlink,
        hold: Hold,
        holder: Holder,
        watch: PilotWatch,
        inquiry: Inquiry,
    ) -> None:
        self.settings = SafetySettings()
        """The last that a tower has sent, over a lost link too."""
        self.held_at = float("-inf")
        """When the last hold began, whoever wanted it."""
        self._autopilot = autopilot
        self._downlink = downlink
        self._hold = hold
        self._holder = holder
        self._watch = watch
        self._inquiry = inquiry
        self._lost = LostActing(maker)
        self._control_changed_at: float | None = None

    def control_changed(self, now: float) -> None:
        """The epoch has grown."""
        self._control_changed_at = now

    def heartbeat(self, now: float) -> None:
        """A HEARTBEAT of the autopilot; the view has read it."""
        view = self._autopilot
        self._watch.heartbeat(armed=view.armed, now=now)
        self._hold.heartbeat(armed=view.armed, custom_mode=view.custom_mode, now=now)
        self._hold.modes_became_known(self._rungs(), now)
        self._lost.heartbeat(view.custom_mode)
        self._holder.heartbeat(now)

    def mode_acknowledged(self, ack: Any, now: float) -> None:
        """A COMMAND_ACK for MAV_CMD_DO_SET_MODE that is meant for us."""
        self._hold.acknowledged(ack, now)
        self._lost.acknowledged(ack, now)

    def hold_now(self, cause: HoldCause, now: float, *, order_id: int = 0, why: str = "") -> None:
        """Holds. `order_id`: of the tower's order. `why`: for a person, where nobody ordered it."""
        view = self._autopilot
        self.held_at = now
        needed = view.armed or not view.heard
        self._holder.hold_begins(needed=needed)
        modes = self._modes()
        if cause is HoldCause.ORDER and modes is not None and view.custom_mode == modes.mission.custom_mode:
            changed_at = self._control_changed_at
            self._holder.mission_before_hold = changed_at is None or now - changed_at > SAME_CHANGE_S
        self._hold.begin(
            cause=cause,
            order_id=order_id,
            epoch=self._downlink.epoch,
            rungs=self._rungs(),
            settings=self.settings,
            needed=needed,
            now=now,
            why=why,
        )

    def look(self, now: float, *, may_start: bool) -> None:
        """What the agent notices by itself: a pilot who is gone, a tower that stays lost.

        `may_start`: whether the mission on board may be flown.
        """
        by_hand = self._holder.by_hand
        self._holder.look(now)
        alarm = None
        if not self._holder.wish.open:
            kept_centred = self._holder.stand_in.on or (self._hold.sticks_on and self._hold.cause is HoldCause.ORDER)
            alarm = self._watch.alarm(now, settings=self.settings, flown_by_hand=by_hand, kept_centred=kept_centred)
        if alarm is not None:
            _log.warning("%s: holding", alarm.why)
            self.hold_now(alarm.cause, now, why=alarm.why)
        view = self._autopilot
        loss = Loss(
            tower_gone_s=self._watch.loss.tower_gone_s(now),
            ours=view.airborne(now) and (self._watch.tower_in_this_flight or not by_hand),
            custom_mode=view.custom_mode,
            mission_before_hold=self._holder.mission_before_hold and may_start,
        )
        deed = self._lost.tick(now, loss=loss, settings=self.settings, modes=self._modes())
        if deed not in (None, Deed.LEAVE):
            self._holder.gate.close()
            self._watch.nobody_needed()
            self._hold.overruled(needs_sticks=False, now=now, why=f"the tower stays lost: {deed}")

    def due(self, now: float) -> list[bytes]:
        """What a hold, the lost action and the holder's wish have to send."""
        system_id = self._autopilot.system_id or 1
        frames = self._hold.tick(
            now,
            vehicle_system_id=system_id,
            ground_station_system_id=self._inquiry.ground_station_system_id,
            tower_silent_s=self._watch.loss.silent_s(now),
        )
        if self._hold.sticks_on:
            self._inquiry.sticks_sent(now)
        frames += self._lost.due(now, vehicle_system_id=system_id)
        frames += self._holder.wish.due(now, vehicle_system_id=system_id)
        for line in self._lost.take_notices():
            _log.warning("%s", line)
        return frames

    def _modes(self) -> Modes | None:
        return modes_of(self._autopilot.kind, self._autopilot.vehicle_type)

    def _rungs(self) -> tuple[FlightMode, ...]:
        return hold_rungs(self._modes(), self.settings.hold_ladder)
