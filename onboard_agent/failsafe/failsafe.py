"""Decides when the drone holds and when the lost action starts. Connects watches, hold and lost action. No I/O.

Takes `now`. Each part defines its rules in its own file. This module only passes events between them, in order.
"""

import logging
from typing import Any, Final

from onboard_agent.autopilot.autopilot_state import AutopilotView
from onboard_agent.autopilot.flight_modes import hold_rungs, holds_when_centred, modes_of
from onboard_agent.autopilot.inquiry import Inquiry
from onboard_agent.autopilot.mode_names import mode_name
from onboard_agent.autopilot.motion import Motion
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.autopilot.recent_start import RecentStart
from onboard_agent.failsafe.flying import Flying
from onboard_agent.failsafe.hold import Hold
from onboard_agent.failsafe.hold_memory import HoldRecord
from onboard_agent.failsafe.holder import Holder
from onboard_agent.failsafe.lost_action import Loss, LostActionRunner
from onboard_agent.failsafe.lost_action_table import LossResponse
from onboard_agent.failsafe.person_watch import PersonWatch
from onboard_agent.failsafe.pilot_watch import PilotWatch
from onboard_agent.failsafe.way_home import WayHome
from onboard_agent.link.downlink import Downlink
from onboard_agent.sticks.stick_release import StickRelease
from wire.autopilots.profile import FailsafeModes, FlightMode
from wire.control_messages import HoldCause, HoldStep, SafetySettings
from wire.open_holds import AfterSticks, HoldStage, LostAction, LostPhase

_log = logging.getLogger(__name__)

SAME_HANDOVER_S: Final = 2.0
"""A hold ordered this soon after an increase of the epoch belongs to that hand-over."""

DIRECT_ABOVE_M: Final = 2.0
"""Below this the drone may be taking off or landing. A hold then begins with stage one, which keeps the height."""

STICKS_COME_WITHIN_S: Final = 3.0
STANDS_AFTER_S: Final = 3.0
"""Longer than a take-off by command needs to leave the ground."""
WATCHED_ONLY: Final = "this vehicle is watched only: nobody has measured how it holds, and the agent sent it nothing"
STILL_M_S: Final = 0.7
FAST_M_S: Final = 4.5


class Failsafe:
    """Call `check` at each tick, and `due` at each tick and after each event that may change a mode."""

    def __init__(
        self,
        maker: FrameMaker,
        *,
        autopilot: AutopilotView,
        motion: Motion,
        downlink: Downlink,
        hold: Hold,
        holder: Holder,
        watch: PilotWatch,
        person: PersonWatch,
        inquiry: Inquiry,
    ) -> None:
        self.settings = SafetySettings()
        """The last settings from a tower; they stay in force while the link is lost."""
        self.held_at = float("-inf")
        """When the last hold began, for whatever reason."""
        self.lost = LostActionRunner(maker)
        self.start = RecentStart()
        self._autopilot = autopilot
        self._motion = motion
        self._downlink = downlink
        self._hold = hold
        self._holder = holder
        self._watch = watch
        self._person = person
        self._inquiry = inquiry
        self._way_home = WayHome()
        self._release = StickRelease(maker)
        self._control_changed_at: float | None = None
        self._commanded = 0
        """`Holder.commanded` when it was last checked."""
        self._radio_took_over = False
        """Another source selected a mode that needs sticks, on a drone with a receiver."""

    @property
    def needed_percent(self) -> float:
        """Battery percentage needed for the way home."""
        return self._way_home.needed_percent(home_m=self._motion.home_m, alt_rel_m=self._motion.alt_rel_m)

    def control_changed(self, now: float) -> None:
        """The epoch has increased."""
        self._control_changed_at = now

    def tower_was_in_this_flight(self, now: float) -> None:
        """The previous process had seen sticks or commands of the tower in this flight."""
        self._watch.used(now)

    def heartbeat(self, now: float) -> None:
        """Handles a HEARTBEAT of the autopilot, after the view has read it."""
        view = self._autopilot
        self._watch.heartbeat(armed=view.armed, now=now)
        by_failsafe = view.failsafe.active
        self._hold.heartbeat(armed=view.armed, custom_mode=view.custom_mode, now=now, by_failsafe=by_failsafe)
        self._hold.modes_became_known(self._rungs(now), self._stay_modes(now), now)
        self.lost.heartbeat(view.custom_mode)
        self._holder.heartbeat(now)
        if view.watched_only and self._hold.open:
            # Ordered before its kind was known. For many vehicles centred sticks are half throttle: ask for none.
            self._hold.overruled(needs_sticks=False, now=now, why=WATCHED_ONLY)
            self._holder.gate.let_go()
        if not view.armed or view.watched_only:
            self._person.attended()

    def mode_acknowledged(self, ack: Any, now: float) -> None:
        """Handles a COMMAND_ACK for MAV_CMD_DO_SET_MODE that is addressed to the agent."""
        self._hold.acknowledged(ack, now)
        self.lost.acknowledged(ack, now)

    @property
    def going_home(self) -> bool:
        """Whether the autopilot is in a mode that ends on the ground by itself."""
        view, modes = self._autopilot, self._modes()
        if not (view.heard and view.armed) or modes is None:
            return False
        return any(view.custom_mode == mode.custom_mode for mode in modes.going_home)

    @property
    def own_action(self) -> str:
        """What a drone that goes home does: "returns" or "lands"."""
        modes = self._modes()
        lands = modes is not None and self._autopilot.custom_mode == modes.land.custom_mode
        return "lands" if lands else "returns"

    @property
    def keeps_sticks(self) -> bool:
        """Whether the agent's centred sticks replace missing ones, outside a hold."""
        return self._holder.stick_fallback.on

    def hold_now(
        self,
        cause: HoldCause,
        now: float,
        *,
        order_id: int = 0,
        why: str = "",
        interrupts: bool = True,
        without_sticks: bool = False,
    ) -> None:
        """Starts a hold. `order_id`: the tower's order. `why`: the reason for a person, if nobody ordered the hold.

        `interrupts`: also interrupts a return or landing of the autopilot. `without_sticks`: it was in stage two.
        """
        view = self._autopilot
        epoch = self._downlink.epoch
        if view.watched_only:
            if cause is HoldCause.ORDER:
                step = HoldStep.UNCONFIRMED
                self._hold.stand_aside(order_id=order_id, epoch=epoch, now=now, why=WATCHED_ONLY, step=step)
            return
        self.held_at = now
        repeated = cause is HoldCause.ORDER and not self._holder_changed(now)
        if repeated and self._hold.settled:
            # The person who said "stay" and the time since somebody flew remain valid.
            self._hold.confirm_again(order_id=order_id, epoch=epoch, now=now)
            return
        aside = "a radio pilot flies the drone" if repeated and self._radio_took_over else ""
        if not interrupts and self.going_home and not self._holder.commanded_away_lately(now):
            aside = f"the drone is in {self._mode_name}, and goes on with it"
        if aside:
            self._holder.hold_begins(now, needed=True)
            self._hold.stand_aside(order_id=order_id, epoch=epoch, now=now, why=aside)
            return
        self._radio_took_over = False
        # The autopilot may have left the mode that stays, for a command that is not answered yet.
        called_away = self._holder.mode_request.open
        armed = view.armed or not view.heard or self.start.counts_as_armed(now)
        self._holder.hold_begins(now, needed=True)
        modes = self._modes()
        if cause is HoldCause.ORDER and modes is not None and view.custom_mode == modes.mission.custom_mode:
            self._holder.mission_before_hold = not self._holder_changed(now)
        stays_already = without_sticks or (self._hold.stage is HoldStage.STAY and not called_away)
        self.lost.restart()
        if armed:
            self._person.hold_began(now)
        stays = self._stay_modes(now, stays_already=stays_already)
        # GUIDED, or LOITER on PX4, may be flying to a position: requesting it again does not stop the drone.
        first = (
            [mode for mode in stays if stays_already or mode.custom_mode != view.custom_mode] if not called_away else []
        )
        rungs, ignored = self._rungs(now), self._inquiry.ignores_sticks(view.kind)
        if ignored and stays and self._motion.has_position(now) is not False:
            # Altitude hold would sink or climb as the transmitter's throttle was left.
            first, rungs = list(stays), ()
        elif self._inquiry.sticks_settle_s(view.kind):
            # The jump to centred sticks would end a mode without sticks at once: such a mode is stage two.
            rungs = tuple(mode for mode in rungs if mode not in stays)
        self._hold.begin(
            cause=cause,
            order_id=order_id,
            epoch=epoch,
            rungs=rungs,
            stays=stays,
            first=first,
            armed=armed,
            sticks=not ignored
            and (self._holder.by_hand or not (stays_already or self._flies_without_sticks(now)) or not first),
            now=now,
            why=why,
        )

    def _holder_changed(self, now: float) -> bool:
        """Whether an order that arrives now belongs to a hand-over. Otherwise it repeats an earlier order."""
        return self._control_changed_at is not None and now - self._control_changed_at <= SAME_HANDOVER_S

    def _flies_without_sticks(self, now: float) -> bool:
        """Whether the drone is high enough, has a position and no sticks in force, so that a hold needs none."""
        return (
            self._autopilot.heard
            and not self._holder.by_hand
            and not self._holder.stick_fallback.in_force(now, lasts_s=self._inquiry.overrides_last_s)
            and self._autopilot.airborne(now)
            and self._motion.alt_rel_m > DIRECT_ABOVE_M
            and not self._motion.sinking(now)
            and self._motion.has_position(now) is True
        )

    def check(self, now: float, *, may_start: bool, station_silent_s: float | None = None) -> None:
        """Checks for a lost pilot, and for a tower or person that stays lost.

        `may_start`: whether the mission on board may be flown. `station_silent_s`: since when the autopilot misses a
        ground station's heartbeats; None: it does not.
        """
        by_hand, view = self._holder.by_hand, self._autopilot
        self._holder.update(now)
        if view.watched_only:
            return
        if self._hold.open and self._person.absent_s(now) is None and self._hold.open_s(now) >= self._patience_s:
            self._person.hold_began(now)
        if self._hold.open and not (self._hold.holds or by_hand or self._holder.wants_sticks(now)) and view.armed:
            # The autopilot has refused the mode for which the agent keeps the sticks centred.
            self._hold.overruled(needs_sticks=False, now=now, why=f"the autopilot stays in {self._mode_name}")
        self._check_position(now)
        self._check_foreign_mode(now)
        self._check_pilot(now, by_hand=by_hand)
        motion = self._motion
        airborne = view.airborne(now)
        self._person.seen(now, needs_somebody=airborne and self._needs_somebody(by_hand=by_hand))
        self._way_home.seen(now, airborne=airborne, percent=motion.battery_percent)
        loss = Loss(
            tower_gone_s=self._watch.loss.tower_gone_s(now),
            person_gone_s=self._person.absent_s(now),
            stayed=self._person.stayed,
            ours=airborne and (self._watch.tower_in_this_flight or self._hold.open or not by_hand),
            custom_mode=view.custom_mode,
            mission_is_over=view.mission_is_over,
            mission_before_hold=self._holder.mission_before_hold and may_start,
            drifts=motion.has_position(now) is False,
            battery_due=self._way_home.due(
                percent=motion.battery_percent, home_m=motion.home_m, alt_rel_m=motion.alt_rel_m
            ),
            own=self._own_loss(station_silent_s),
        )
        response = self.lost.tick(now, loss=loss, settings=self.settings, modes=self._modes())
        if response not in (None, LossResponse.LEAVE):
            self._holder.gate.close()
            self._watch.no_pilot_needed()
            self._hold.yield_mode()
        if response is LossResponse.STOP_STICKS:
            self._hold.overruled(needs_sticks=False, now=now, why=self.lost.detail)
        self._lost_action_done(now)

    def _own_loss(self, station_silent_s: float | None) -> tuple[LostAction, float] | None:
        """What the autopilot does by itself without a ground station, and in how many seconds."""
        view = self._autopilot
        if station_silent_s is None:
            return None
        own = self._inquiry.station_lost(view.kind, view.custom_mode, mission_is_over=view.mission_is_over)
        return None if own is None else (own[0], own[1] - station_silent_s)

    def _needs_somebody(self, *, by_hand: bool) -> bool:
        """Whether a drone in the air flies by the tower's doing, and was not started to fly alone.

        A mission that is over flies no more: the drone hovers until its battery is empty. A hand that goes away is the
        hold's affair, and a transmitter's pilot is there.
        """
        modes, view = self._modes(), self._autopilot
        is_mission = modes is not None and view.custom_mode == modes.mission.custom_mode and not view.mission_is_over
        # A return that this loss has brought about is no sign of a person.
        is_going_home = self.going_home and self.lost.phase is LostPhase.QUIET
        return self._watch.tower_in_this_flight and not (by_hand or is_mission or is_going_home)

    @property
    def _patience_s(self) -> float:
        """Time that a person who commands a mode with sticks has to take the sticks."""
        return 0.0 if self._hold.holds else STICKS_COME_WITHIN_S

    def _check_pilot(self, now: float, *, by_hand: bool) -> None:
        if self._hold.pop_failed_hand_over():
            self.hold_now(HoldCause.STICKS_STALE, now, why="the sticks stopped while they were taken up")
            return
        if self._holder.mode_request.open:
            return
        kept_centred = self._holder.stick_fallback.for_assistant or (self._hold.sticks_on and not self._hold.holds)
        alarm = self._watch.alarm(now, settings=self.settings, flown_by_hand=by_hand, kept_centred=kept_centred)
        if alarm is not None:
            _log.warning("%s: holding", alarm.why)
            self.hold_now(alarm.cause, now, why=alarm.why)

    def _check_position(self, now: float) -> None:
        """Leaves a hold mode that needs a position when it is lost: ArduCopter lands 1 s after it reports the loss."""
        view, modes = self._autopilot, self._modes()
        if modes is None or not self._hold.open or self._motion.has_position(now) is not False:
            return
        if any(view.custom_mode == mode.custom_mode for mode in (*modes.position_holds, *modes.pauses)):
            self._hold.back_to_altitude(modes.altitude_hold, now)

    def _check_foreign_mode(self, now: float) -> None:
        """Handles a mode that neither tower nor agent requested: a radio switch, another ground station, a failsafe."""
        if self._hold.foreign_mode(now) is None or self.lost.phase is LostPhase.ASKING:
            return
        own_words = self._autopilot.failsafe.words
        why = f"the autopilot went to {self._mode_name} by itself" + (
            f": {own_words}" if own_words else ", or by another hand"
        )
        _log.warning("%s", why)
        by_radio = self._inquiry.has_radio is True or self._inquiry.switched(now)
        if self._holder.by_hand and not by_radio:
            self.hold_now(HoldCause.PILOT_LOST, now, why=why)
            return
        self._hold.overruled(needs_sticks=False, now=now, why=why)
        if self.going_home:
            # Nobody flies the drone, so the loss stays reported until it is down.
            lands = self.own_action == "lands"
            self.lost.done_by_autopilot(LostAction.LAND if lands else LostAction.RETURN, why)
            return
        self._radio_took_over = self._holder.by_hand
        if self._radio_took_over:
            self._release.begin(now)
        self._person.attended()

    def _lost_action_done(self, now: float) -> None:
        """Ends a hold in favour of the lost action, unless the holder has commanded something since.

        A mode that needs sticks is not the end of the loss: without sticks the countdown starts again.
        """
        if self._commanded != self._holder.commanded:
            self._commanded = self._holder.commanded
            if self.lost.phase is LostPhase.DONE:
                self.lost.restart()
        if self.lost.phase is LostPhase.DONE and self._hold.open:
            self._hold.overruled(needs_sticks=False, now=now, why=self.lost.detail)

    def due(self, now: float) -> list[bytes]:
        """Returns the frames of the hold, the lost action and the holder's mode request."""
        if self._autopilot.watched_only:
            return []
        system_id = self._autopilot.system_id or 1
        frames = self._hold.tick(now, self._flying(now))
        if self._hold.sticks_on:
            self._inquiry.sticks_sent(now)
            self._holder.stick_fallback.others_sent(now)
        frames += self.lost.due(now, vehicle_system_id=system_id)
        self._lost_action_done(now)
        frames += self._holder.mode_request.due(now, vehicle_system_id=system_id)
        frames += self._release.due(
            now,
            wanted=self._inquiry.sticks_hide_receiver(self._autopilot.kind) and not self._hold.sticks_on,
            vehicle_system_id=system_id,
            ground_station_system_id=self._inquiry.ground_station_system_id,
        )
        for line in self.lost.pop_notices():
            _log.warning("%s", line)
        return frames

    def _flying(self, now: float) -> Flying:
        view, motion = self._autopilot, self._motion
        obeys = holds_when_centred(view.kind, view.custom_mode)
        return Flying(
            vehicle_system_id=view.system_id or 1,
            may_be_held=view.may_be_held,
            ground_station_system_id=self._inquiry.ground_station_system_id,
            airborne=view.airborne(now),
            stands=self._stands(now),
            level=motion.level(now),
            has_position=motion.has_position(now),
            still=motion.speed_m_s < STILL_M_S,
            fast=motion.speed_m_s > FAST_M_S,
            sinking=motion.sinking(now),
            low_and_sinking=obeys and view.airborne(now) and motion.low_and_sinking(now),
            by_hand=self._holder.by_hand and not self._inquiry.switched(now),
            by_failsafe=view.failsafe.misses_sticks,
            ignores_sticks=self._inquiry.ignores_sticks(view.kind),
            sticks_settle_s=self._inquiry.sticks_settle_s(view.kind),
            pilot_fresh=self._holder.stick_fallback.person_fresh(now),
            after_sticks=lambda custom_mode: self._inquiry.after_sticks(view.kind, custom_mode, now),
        )

    def _stands(self, now: float) -> bool:
        """Whether the throttle may rest: the height must agree with a landed state, which may err in the air."""
        view = self._autopilot
        stands_s = min(view.on_ground_s(now), self._hold.open_s(now))
        return view.armed and stands_s >= STANDS_AFTER_S and self._motion.alt_rel_m < DIRECT_ABOVE_M

    def record(self) -> HoldRecord | None:
        """Returns what a restarted process must know, or None."""
        view, held, by_hand = self._autopilot, self._hold.open, self._watch.hand_on_sticks
        if not view.may_be_held or not (held or (view.armed and (by_hand or self._watch.tower_in_this_flight))):
            return None
        return HoldRecord(
            system_id=view.system_id or 1,
            autopilot_kind=view.kind,
            vehicle_type=view.vehicle_type,
            ground_station_system_id=self._inquiry.ground_station_system_id,
            sticks=self._hold.sticks_on or by_hand,
            held=held,
            why=self._hold.why if held else "",
            settings=self.settings,
        )

    @property
    def _mode_name(self) -> str:
        view = self._autopilot
        return mode_name(view.kind, view.vehicle_type, view.custom_mode)

    def _modes(self) -> FailsafeModes | None:
        return modes_of(self._autopilot.kind, self._autopilot.vehicle_type)

    def _rungs(self, now: float) -> tuple[FlightMode, ...]:
        rungs = hold_rungs(self._modes(), self.settings.hold_ladder)
        # Without a position the autopilot accepts the other modes for a while, then lands on its own.
        return rungs[-1:] if self._motion.has_position(now) is False else rungs

    def _stay_modes(self, now: float, *, stays_already: bool = False) -> tuple[FlightMode, ...]:
        """Modes for stage two: the current one if stage two was reached, then those that continue without sticks."""
        modes, view = self._modes(), self._autopilot
        if modes is None:
            return ()

        def rank(mode: FlightMode) -> tuple[bool, bool]:
            after = self._inquiry.after_sticks(view.kind, mode.custom_mode, now)
            return not (stays_already and mode.custom_mode == view.custom_mode), after is not AfterSticks.STAYS

        return tuple(sorted(modes.pauses, key=rank))
