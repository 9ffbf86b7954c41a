"""Everything the agent decides, between its two shells: the autopilot's port and the tower's link. No I/O.

Verbs in: what came from either side, and the time. What is to be sent is taken out with `take_to_autopilot` and
`take_to_tower`. The order of events is the order of calls; nothing here waits.
"""

import logging
from collections import Counter
from typing import Any, Final

from onboard_agent.autopilot_state import AutopilotEvent, AutopilotView
from onboard_agent.command_wish import CommandWish
from onboard_agent.downlink import SETUP_SIGNING, Downlink
from onboard_agent.flight_modes import (
    FlightMode,
    Modes,
    flies_without_sticks,
    hold_rungs,
    holds_when_centred,
    modes_of,
)
from onboard_agent.hold import Hold
from onboard_agent.inquiry import READ, Inquiry
from onboard_agent.intent import INTERESTING, Command, Sticks, Target, arms, read_intent
from onboard_agent.late_frames import too_late
from onboard_agent.lost_action import Loss, LostActing
from onboard_agent.lost_action_table import Deed
from onboard_agent.own_frames import AGENT_COMPONENT, FrameMaker
from onboard_agent.pilot_watch import PilotWatch
from onboard_agent.presence import Presence
from onboard_agent.safety import within_limits
from onboard_agent.stand_in import StandIn
from onboard_agent.stick_gate import StickGate
from onboard_agent.telemetry_stream import TelemetryStream
from onboard_agent.tower_news import TowerNews
from wire.content import Frames
from wire.control_messages import (
    ControlChanged,
    HoldCause,
    HoldOrder,
    SafetySettings,
    StreamSettings,
    ToAgent,
    ToTower,
    Welcome,
)
from wire.dialect import decode, mavlink
from wire.frames import message_id, source
from wire.ids import DroneId, Epoch
from wire.lateness import Lateness

_log = logging.getLogger(__name__)

SAME_CHANGE_S: Final = 2.0
"""A hold that is ordered this soon after the epoch has grown belongs to the change of hands."""

_READ: Final = READ | {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
    mavlink.MAVLINK_MSG_ID_COMMAND_ACK,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
}
"""The only messages whose payload we look at; everything else goes by unread."""


class Onboard:
    """One drone. `speaks_first`: the autopilot hears of us only when we have spoken. `narrow_line`: no room to spare on
    the way to it. `steps_told`: where the numbers of the steps of holds begin (Hold)."""

    def __init__(self, *, now: float, speaks_first: bool, narrow_line: bool = False, steps_told: int = 0) -> None:
        maker = FrameMaker()
        self.autopilot = AutopilotView()
        self.downlink = Downlink()
        self.stream = TelemetryStream()
        self.hold = Hold(maker, steps_told)
        self.counts: Counter[str] = Counter()
        """Frames not passed on for reasons that the downlink does not know, by reason."""
        self.settings = SafetySettings()
        """The last that a tower has sent, over a lost link too."""
        self._gate = StickGate()
        self._stand_in = StandIn(maker)
        self._wish = CommandWish(maker)
        self._watch = PilotWatch(now)
        self._lateness = Lateness()
        self._lost = LostActing(maker)
        self._mission_before_hold = False
        """A trigger, not a change of hands, has stopped a mission, and nobody has flown since."""
        self._control_changed_at: float | None = None
        self._presence = Presence(maker, speaks_first=speaks_first)
        self._inquiry = Inquiry(maker, narrow_line=narrow_line)
        self._holder_present = False
        self._news = TowerNews(autopilot=self.autopilot, hold=self.hold, inquiry=self._inquiry, stream=self.stream)
        self._newest_order = 0
        self._newest_control = 0
        self._to_autopilot: list[bytes] = []

    # From the autopilot

    def from_autopilot(self, frames: list[bytes], now: float) -> list[bytes]:
        """Frames came from the autopilot's side; returns those that go to the tower at once."""
        passed: list[bytes] = []
        for frame in frames:
            msgid = message_id(frame)
            if msgid == SETUP_SIGNING:
                self.counts["setup_signing"] += 1
                continue
            passed.append(frame)
            system_id, component_id = source(frame)
            if self.autopilot.is_autopilot(system_id, component_id):
                self.autopilot.anything_heard(now)
                self._inquiry.heard(msgid, now)
            if msgid in _READ:
                message = decode(frame)
                if message is not None:
                    self._read(message, frame, now)
        return self.stream.admit(passed)

    def _read(self, message: Any, frame: bytes, now: float) -> None:
        view = self.autopilot
        msgid = message_id(frame)
        system_id, component_id = source(frame)
        event: AutopilotEvent | None = None
        if msgid == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            event = view.heartbeat(message, system_id, component_id, now)
            if view.is_autopilot(system_id, component_id):
                self._heartbeat(now)
        elif not view.is_autopilot(system_id, component_id):
            return
        elif msgid == mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT:
            event = view.global_position(message)
        elif msgid == mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE:
            view.extended_sys_state(message, now)
        elif msgid in READ:
            self._inquiry.answer(msgid, message, frame, now)
        else:
            if not self._is_only_ours(message) and self._wish.refused(message):
                self.hold.go_on()
            if self._is_ours(message):
                self._acknowledged(message, now)
        self._autopilot_event(event, now)

    def _heartbeat(self, now: float) -> None:
        view = self.autopilot
        self._watch.heartbeat(armed=view.armed, now=now)
        self.hold.heartbeat(armed=view.armed, custom_mode=view.custom_mode, now=now)
        self.hold.modes_became_known(self._rungs(), now)
        self._lost.heartbeat(view.custom_mode)
        if self._wish.granted(needs_sticks=self._flown_by_hand()):
            self._flies_by_command(now)
        if not view.armed:
            self._gate.let_go()
            self._mission_before_hold = False

    def _acknowledged(self, ack: Any, now: float) -> None:
        if ack.command != mavlink.MAV_CMD_DO_SET_MODE:
            self._inquiry.acknowledged(ack, now)
            return
        self.hold.acknowledged(ack, now)
        self._lost.acknowledged(ack, now)
        # A refusal sends us to the next mode at once, not at the next tick.
        self._drive_modes(now)

    def _is_ours(self, ack: Any) -> bool:
        """Whether an acknowledgement answers the agent, or does not say whom it answers."""
        return ack.target_system in (0, self.autopilot.system_id) and ack.target_component in (0, AGENT_COMPONENT)

    def _is_only_ours(self, ack: Any) -> bool:
        """Whether an acknowledgement says that it answers the agent."""
        return (ack.target_system, ack.target_component) == (self.autopilot.system_id, AGENT_COMPONENT)

    def _autopilot_event(self, event: AutopilotEvent | None, now: float) -> None:
        if event is None:
            return
        if event is AutopilotEvent.LOST:
            _log.warning("the autopilot is silent")
            return
        _log.info("autopilot %s: system %s, kind %d", event, self.autopilot.system_id, self.autopilot.kind)
        self._inquiry.ask_all(self.autopilot.kind, now)

    # From the tower

    def welcomed(self, welcome: Welcome, now: float) -> None:
        """A new link is up."""
        self.downlink.new_link(DroneId(welcome.drone_id), Epoch(welcome.epoch))
        self._holder_present = welcome.holder_present
        self._stand_in.end()
        self._newest_order = self._newest_control = 0
        # Another link, perhaps another tower: its clock is not the one that we measured.
        self._lateness = Lateness()
        self._watch.loss.link_up(now)
        self.stream.link_up(now)
        self._news.link_up()

    def resumed(self) -> None:
        """The link goes on with another control channel: what was told on the last may be lost."""
        self._news.link_up()

    def link_broken(self, now: float) -> None:
        """The link is down, whoever ended it."""
        self._news.link_down()
        self._holder_present = False
        self._stand_in.end()
        self._watch.loss.link_down(now)
        self.stream.link_down()

    def tower_heard(self, now: float) -> None:
        """An authentic datagram of the tower came."""
        self._watch.loss.tower_heard(now)

    def message(self, message: ToAgent, now: float) -> None:
        """A message of the control channel came."""
        if isinstance(message, ControlChanged):
            if 0 < message.number <= self._newest_control:
                return  # it comes on two channels, and more than once
            self._newest_control = message.number
            if message.epoch >= self.downlink.epoch:
                self._stand_in.turn(assistant_flies=message.assistant_flies)
            self._epoch_told(message.epoch, now)
            self.downlink.raise_epoch(message.epoch)
            self._holder_present = message.holder_present
            if not message.holder_present:
                # The tower orders a hold too when it comes to it; two who watch are better than one.
                self._watch.loss.pilot_cut_off(now)
        elif isinstance(message, HoldOrder):
            if message.order_id <= self._newest_order:
                return  # it comes on two channels, and more than once
            self._newest_order = message.order_id
            self._epoch_told(message.epoch, now)
            self.downlink.raise_epoch(message.epoch)
            _log.warning("hold ordered: %s", message.reason)
            self._watch.used(now)
            self._begin_hold(HoldCause.ORDER, now, order_id=message.order_id)
        elif isinstance(message, SafetySettings):
            settings = within_limits(message)
            if settings != self.settings:
                _log.info("safety settings: %s", settings)
            self.settings = settings
        elif isinstance(message, StreamSettings):
            self.stream.chosen(message)

    def _epoch_told(self, epoch: int, now: float) -> None:
        if epoch > self.downlink.epoch:
            self._control_changed_at = now

    def from_tower(self, content: Frames, now: float) -> None:
        """Frames came over the data channel; those that may pass are due to the autopilot."""
        late_s = self._lateness.late_by(content.sent_ms, now)
        for frame in self.downlink.admit(content):
            msgid = message_id(frame)
            refused = too_late(msgid, late_s, self.settings)
            if refused is None and msgid in INTERESTING and not self._intent_passes(frame, now):
                refused = "sticks not centred after a hold"
            if refused is not None:
                self.counts[refused] += 1
                continue
            self._to_autopilot.append(frame)

    def _intent_passes(self, frame: bytes, now: float) -> bool:
        if arms(frame):
            self._watch.used(now)
        intent = read_intent(frame, autopilot_kind=self.autopilot.kind, middles_us=self._inquiry.channel_middles_us)
        if intent is None:
            return True
        if isinstance(intent, Sticks):
            if not self._gate.admit(intent):
                return False
            self.hold.stop_sticks()
            self._watch.sticks_passed(now)
            self._stand_in.sticks_passed(now)
            self.stream.sticks_passed(now)
            self._inquiry.sticks_sent(now)
        else:
            self._watch.used(now)
            self._commanded(intent, now)
        self._mission_before_hold = False
        return True

    def _commanded(self, intent: Command | Target, now: float) -> None:
        if isinstance(intent, Command) and intent.needs_sticks:
            self._wish.over()
            self.hold.go_on()
            self.hold.overruled(needs_sticks=True, now=now)
        elif not self._flown_by_hand():
            self._flies_by_command(now)
        elif isinstance(intent, Command):
            self._wish.ask(intent.command, now)
            self.hold.wait()

    def _flies_by_command(self, now: float) -> None:
        """No hand is needed on the sticks, as the autopilot shows."""
        self._wish.over()
        self.hold.overruled(needs_sticks=False, now=now)
        self._gate.let_go()
        self._watch.nobody_needed()

    # Time, and what is to be sent

    def tick(self, now: float) -> None:
        """Time has passed: every 25 ms or so."""
        self._autopilot_event(self.autopilot.tick(now), now)
        self._look(now)
        self._centre_for_assistant(now)
        self._drive_modes(now)
        view = self.autopilot
        out = self._to_autopilot
        out += self._presence.due(
            now,
            vehicle_system_id=view.system_id,
            ground_station_system_id=self._inquiry.ground_station_system_id,
            holder_present=self._holder_present,
            tower_silent_s=self._watch.loss.silent_s(now),
        )
        if view.system_id is not None and view.heard:
            self._inquiry.follow(self.stream.profile)
            out += self._inquiry.due(now, vehicle_system_id=view.system_id)

    def _look(self, now: float) -> None:
        """What the agent notices by itself: a pilot who is gone, a tower that stays lost."""
        by_hand = self._flown_by_hand()
        if self._wish.lapsed(now):
            self.hold.go_on()
        alarm = None
        if not self._wish.open:
            kept_centred = self._stand_in.on or (self.hold.sticks_on and self.hold.cause is HoldCause.ORDER)
            alarm = self._watch.alarm(now, settings=self.settings, flown_by_hand=by_hand, kept_centred=kept_centred)
        if alarm is not None:
            _log.warning("%s: holding", alarm.why)
            self._begin_hold(alarm.cause, now, why=alarm.why)
        view = self.autopilot
        loss = Loss(
            tower_gone_s=self._watch.loss.tower_gone_s(now),
            ours=view.airborne(now) and (self._watch.tower_in_this_flight or not by_hand),
            custom_mode=view.custom_mode,
            mission_before_hold=self._mission_before_hold,
        )
        deed = self._lost.tick(now, loss=loss, settings=self.settings, modes=self._modes())
        if deed not in (None, Deed.LEAVE):
            self._gate.close()
            self._watch.nobody_needed()
            self.hold.overruled(needs_sticks=False, now=now, why=f"the tower stays lost: {deed}")

    def _centre_for_assistant(self, now: float) -> None:
        view = self.autopilot
        frames = self._stand_in.due(
            now,
            wanted=view.armed and self._watch.hand_on_sticks and holds_when_centred(view.kind, view.custom_mode),
            sticks_stale_s=self.settings.sticks_stale_s,
            bound_s=self.settings.hold_bound_s,
            vehicle_system_id=view.system_id or 1,
            ground_station_system_id=self._inquiry.ground_station_system_id,
        )
        if self._stand_in.on:
            self._watch.stood_in(now)
            self._inquiry.sticks_sent(now)
        self._to_autopilot += frames

    def _drive_modes(self, now: float) -> None:
        """Sends what a hold and the lost action have due."""
        view = self.autopilot
        system_id = view.system_id or 1
        self._to_autopilot += self.hold.tick(
            now,
            vehicle_system_id=system_id,
            ground_station_system_id=self._inquiry.ground_station_system_id,
            tower_silent_s=self._watch.loss.silent_s(now),
        )
        if self.hold.sticks_on:
            self._inquiry.sticks_sent(now)
        self._to_autopilot += self._lost.due(now, vehicle_system_id=system_id)
        self._to_autopilot += self._wish.due(now, vehicle_system_id=system_id)
        for line in self._lost.take_notices():
            _log.warning("%s", line)

    def take_to_autopilot(self) -> list[bytes]:
        """Frames to write to the autopilot now, in order."""
        frames, self._to_autopilot = self._to_autopilot, []
        return frames

    def frames_to_tower(self, now: float) -> list[bytes]:
        """Frames of the autopilot that have waited for their beat."""
        return self.stream.due(now)

    def take_to_tower(self, now: float) -> list[ToTower]:
        """Messages for the control channel, in order; nothing while there is no link, but progress is kept for it."""
        return self._news.take(now)

    def _modes(self) -> Modes | None:
        return modes_of(self.autopilot.kind, self.autopilot.vehicle_type)

    def _rungs(self) -> tuple[FlightMode, ...]:
        return hold_rungs(self._modes(), self.settings.hold_ladder)

    def _flown_by_hand(self) -> bool:
        view = self.autopilot
        return view.armed and not flies_without_sticks(view.kind, view.custom_mode)

    def _begin_hold(self, cause: HoldCause, now: float, *, order_id: int = 0, why: str = "") -> None:
        view = self.autopilot
        needed = view.armed or not view.heard
        if needed:
            self._gate.close()
        self._stand_in.end()
        self._wish.over()
        self._watch.nobody_needed()
        modes = self._modes()
        if cause is HoldCause.ORDER and modes is not None and view.custom_mode == modes.mission.custom_mode:
            changed_at = self._control_changed_at
            self._mission_before_hold = changed_at is None or now - changed_at > SAME_CHANGE_S
        self.hold.begin(
            cause=cause,
            order_id=order_id,
            epoch=self.downlink.epoch,
            rungs=self._rungs(),
            settings=self.settings,
            needed=needed,
            now=now,
            why=why,
        )
