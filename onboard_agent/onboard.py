"""All decisions of the agent, between its two I/O shells: the autopilot port and the tower link. No I/O.

Call it with input from either side, and the time. `frames_to_autopilot`, `frames_to_tower` and `messages_to_tower`
return the output. Events take effect in the order of calls; no call waits.
"""

import logging
from collections import Counter
from collections.abc import Callable
from typing import Any, Final

from onboard_agent.autopilot.answers import TIMESYNC, Answers
from onboard_agent.autopilot.autopilot_state import DESCRIBES, AutopilotEvent, AutopilotView
from onboard_agent.autopilot.inquiry import READ, Inquiry
from onboard_agent.autopilot.intent import INTERESTING
from onboard_agent.autopilot.missed_events import READS as EVENTS
from onboard_agent.autopilot.missed_events import MissedEvents
from onboard_agent.autopilot.motion import READ as MOVES
from onboard_agent.autopilot.motion import Motion
from onboard_agent.autopilot.own_frames import FrameMaker, answers_agent_alone, may_answer_agent
from onboard_agent.autopilot.presence import Presence
from onboard_agent.autopilot.rates import RESEARCH
from onboard_agent.autopilot.stick_gesture import GestureGuard
from onboard_agent.autopilot.stop_behind_hold import StopBehindHold
from onboard_agent.failsafe.after_restart import AfterRestart
from onboard_agent.failsafe.failsafe import Failsafe
from onboard_agent.failsafe.hold import Hold
from onboard_agent.failsafe.hold_memory import HoldMemory, HoldStore, NoHoldStore
from onboard_agent.failsafe.hold_state_reporter import HoldStateReporter
from onboard_agent.failsafe.holder import Holder
from onboard_agent.failsafe.late_frames import STICKS, too_late
from onboard_agent.failsafe.person_watch import PersonWatch
from onboard_agent.failsafe.pilot_watch import PilotWatch
from onboard_agent.failsafe.safety import within_limits
from onboard_agent.link.downlink import SETUP_SIGNING, Downlink
from onboard_agent.link.tower_outbox import ROOM, TowerOutbox
from onboard_agent.telemetry.telemetry_stream import TelemetryStream
from onboard_agent.transactions.journal import JournalStore, NoJournal
from onboard_agent.work import MakeHandlers, WorkAtDrone
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
from wire.controllers import ControllerWork
from wire.dialect import decode, mavlink
from wire.drops import DropReason
from wire.following import FollowWork, LeaderPosition
from wire.frame_signing import is_signed
from wire.frames import message_id, source
from wire.ids import DroneId, Epoch
from wire.lateness import Lateness
from wire.open_holds import Stay
from wire.own_system import OwnSystem
from wire.parameter_metadata import MetadataWanted
from wire.transactions import CancelTransaction, CommandWork, Transaction
from wire.zones.nearby import NearbyZones

_log = logging.getLogger(__name__)

_READ: Final = (
    READ
    | MOVES
    | DESCRIBES
    | {
        mavlink.MAVLINK_MSG_ID_HEARTBEAT,
        mavlink.MAVLINK_MSG_ID_COMMAND_ACK,
    }
)
"""The only messages that the agent decodes here; all others pass unread."""

Record = Callable[[list[bytes], float], None]

FLIES: Final = (CommandWork, FollowWork, ControllerWork)
"""Work that must not start late, nor after a hold that began later than the request."""


class Onboard:
    """The decisions for one drone.

    `speaks_first`: the autopilot does not know the agent's address until the agent sends. `narrow_line`: the line to
    the autopilot has no bandwidth to spare. `steps_reported`: where the numbers of hold steps start (Hold). `journal`:
    without one, no plan is written. `holds`: without one, a restarted process knows of no hold. `make_handlers`: makes
    the handlers that need more than the time and the frames. `own`: judges which frames are of this drone. `record`:
    gets all those that are, from either side. `research_hz`: how often the black box wants attitude, sticks and
    outputs; the tower gets them at the usual rates.
    """

    def __init__(
        self,
        *,
        now: float,
        speaks_first: bool,
        narrow_line: bool = False,
        steps_reported: int = 0,
        journal: JournalStore | None = None,
        holds: HoldStore | None = None,
        make_handlers: MakeHandlers = lambda _maker: (),
        own: OwnSystem | None = None,
        record: Record = lambda frames, now: None,
        research_hz: float = 0.0,
    ) -> None:
        maker = FrameMaker()
        self.autopilot = AutopilotView()
        self.motion = Motion()
        self.downlink = Downlink()
        self._own = own or OwnSystem(now=now)
        self._answers = Answers(maker)
        self._record = record
        self.stream = TelemetryStream(RESEARCH if research_hz else {})
        self.autopilot.system_is_fixed = self._own.is_fixed
        self.hold = Hold(maker, steps_reported)
        self.counts: Counter[str] = Counter()
        """Dropped frames by reason, except those that the downlink counts."""
        self.has_news = False
        """Whether something came that the tower should hear of before the next tick (`messages_to_tower`)."""
        self._gestures = GestureGuard()
        self._events = MissedEvents(maker)
        self._stops = StopBehindHold(maker)
        self._watch = PilotWatch(now)
        self._person = PersonWatch()
        self._memory = HoldMemory(holds or NoHoldStore())
        self._least_rtt_s = 0.0
        self._lateness = Lateness()
        self._presence = Presence(maker, speaks_first=speaks_first)
        self._inquiry = Inquiry(maker, narrow_line=narrow_line, research_hz=research_hz)
        self._holder_present = False
        self._holder = Holder(
            maker,
            autopilot=self.autopilot,
            hold=self.hold,
            watch=self._watch,
            person=self._person,
            inquiry=self._inquiry,
            stream=self.stream,
        )
        self._failsafe = Failsafe(
            maker,
            autopilot=self.autopilot,
            motion=self.motion,
            downlink=self.downlink,
            hold=self.hold,
            holder=self._holder,
            watch=self._watch,
            person=self._person,
            inquiry=self._inquiry,
        )
        self._restart = AfterRestart(maker, self._memory.left, now)
        if self._memory.left is not None:
            self.autopilot.assume(self._memory.left.autopilot_kind, self._memory.left.vehicle_type)
            self._inquiry.assume_ground_station(self._memory.left.ground_station_system_id)
            self._failsafe.settings = self._memory.left.settings
        self._work = WorkAtDrone(
            maker,
            autopilot=self.autopilot,
            hold=self.hold,
            holder=self._holder,
            narrow_line=narrow_line,
            journal=journal or NoJournal(),
            make_handlers=make_handlers,
        )
        self._outbox = TowerOutbox(
            autopilot=self.autopilot,
            hold=self.hold,
            hold_reporter=HoldStateReporter(
                autopilot=self.autopilot, hold=self.hold, failsafe=self._failsafe, inquiry=self._inquiry
            ),
            inquiry=self._inquiry,
            stream=self.stream,
            work=self._work,
        )
        self._newest_order = 0
        self._newest_control = 0
        self._to_autopilot: list[bytes] = []

    # From the autopilot

    def from_autopilot(self, frames: list[bytes], now: float) -> list[bytes]:
        """Processes frames from the autopilot's side. Returns those that go to the tower at once."""
        passed: list[bytes] = []
        ours = [frame for frame in frames if self._own.counts(frame, now)]
        if len(ours) != len(frames):
            self.counts[DropReason.OTHER_VEHICLE] += len(frames) - len(ours)
        self._record(ours, now)
        for frame in ours:
            msgid = message_id(frame)
            if msgid == SETUP_SIGNING:
                self.counts["setup_signing"] += 1
                continue
            if msgid == TIMESYNC and self._is_answer(frame, now):
                continue
            heard = msgid in self._work.hears
            if not heard or not self._work.receive(frame, now):
                passed.append(frame)
            if (heard or msgid in _READ) and msgid not in MOVES:
                self.has_news = True
            system_id, component_id = source(frame)
            if self.autopilot.is_autopilot(system_id, component_id):
                self.autopilot.anything_heard(now)
                self._inquiry.heard(msgid, now)
            is_event = msgid in EVENTS and self.autopilot.is_autopilot(system_id, component_id)
            if is_event and self._events.receive(msgid, frame, now):
                self.autopilot.failsafe.event(frame, now)
            if msgid in _READ:
                message = decode(frame)
                if message is not None:
                    self._read(message, frame, now)
        if self.has_news:  # where the drone is comes many times a second, and the next tick is soon enough for it
            self._to_autopilot += self._work.due(now)
        return self.stream.admit(passed, now)

    def _is_answer(self, frame: bytes, now: float) -> bool:
        """Whether a TIMESYNC answers the agent, and is no affair of the tower."""
        message = decode(frame) if self.autopilot.is_autopilot(*source(frame)) else None
        return message is not None and self._answers.timesync(message, now)

    def _read(self, message: Any, frame: bytes, now: float) -> None:
        view = self.autopilot
        msgid = message_id(frame)
        system_id, component_id = source(frame)
        event: AutopilotEvent | None = None
        if msgid == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            event = view.heartbeat(message, system_id, component_id, now)
            if view.is_autopilot(system_id, component_id):
                view.sends_signed = is_signed(frame)
                if not self._restart.over:
                    self._restart.heartbeat(self._failsafe, self.hold, now, armed=view.armed)
                self._failsafe.heartbeat(now)
        elif not view.is_autopilot(system_id, component_id):
            return
        self.motion.read(msgid, message, now)
        if msgid == mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT:
            event = view.global_position(message)
        elif msgid in DESCRIBES:
            view.described(msgid, message, now)
        elif msgid in READ:
            self._inquiry.answer(msgid, message, frame, now)
            if msgid == mavlink.MAVLINK_MSG_ID_SYS_STATUS:
                view.sys_status(message)
                self.hold.outside_fence = view.outside_fence
        elif msgid == mavlink.MAVLINK_MSG_ID_COMMAND_ACK:
            self._failsafe.start.acknowledged(message, now)
            if not answers_agent_alone(message, view.system_id):
                self._holder.acknowledged(message, now)
            if answers_agent_alone(message, view.system_id):
                self._answers.answered(now)
            if may_answer_agent(message, view.system_id):
                self._acknowledged(message, now)
        self._autopilot_event(event, now)

    def _acknowledged(self, ack: Any, now: float) -> None:
        if ack.command != mavlink.MAV_CMD_DO_SET_MODE:
            self._inquiry.acknowledged(ack, now)
            return
        self._failsafe.mode_acknowledged(ack, now)
        # After a refusal the next mode is requested at once, not at the next tick.
        self._act_by_itself(now)

    def _act_by_itself(self, now: float) -> None:
        frames = self._failsafe.due(now)
        self._work.sent(frames, now)
        self._to_autopilot += frames

    def _autopilot_event(self, event: AutopilotEvent | None, now: float) -> None:
        if event is None:
            return
        if event is AutopilotEvent.LOST:
            _log.warning("the autopilot is silent")
            return
        _log.info("autopilot %s: system %s, kind %d", event, self.autopilot.system_id, self.autopilot.kind)
        self._answers.came(now)
        self._inquiry.ask_all(self.autopilot.kind, now)
        self._work.autopilot_came(now)

    # From the tower

    def welcomed(self, welcome: Welcome, now: float) -> None:
        """A new link is up."""
        if self.downlink.epoch:  # on the first link there is no earlier epoch to compare with
            self._accept_epoch(welcome.epoch, now)
        self.downlink.new_link(DroneId(welcome.drone_id), Epoch(welcome.epoch))
        self._holder_present = welcome.holder_present
        self._holder.stick_fallback.end_turn()
        self._person.holder_reported(held=welcome.holder is not None, present=welcome.holder_present, now=now)
        self._least_rtt_s = 0.0
        self._newest_order = self._newest_control = 0
        # The new link may lead to another tower with a clock that has not been measured.
        self._lateness = Lateness()
        self._watch.loss.link_up(now)
        self.stream.link_up(now)
        self._outbox.link_up(welcome.takes)
        self._work.link_up(welcome.takes)
        self._events.link_up(now)
        self._work.epoch(self.downlink.epoch, now)

    def resumed(self) -> None:
        """The link continues on another control channel. Messages sent on the old one may be lost."""
        self._outbox.resumed()
        self._work.resumed()

    def link_broken(self, now: float) -> None:
        """The link is down, no matter which side ended it."""
        self._outbox.link_down()
        self._work.link_down()
        self._holder_present = False
        self._holder.stick_fallback.end_turn()
        self._watch.loss.link_down(now)
        self.stream.link_down()

    def tower_heard(self, now: float) -> None:
        """An authentic datagram from the tower arrived."""
        self._watch.loss.tower_heard(now)

    def round_trip(self, rtt_s: float) -> None:
        """Records a measured round trip to the tower. The shortest one is that of a line without a queue."""
        self._least_rtt_s = min(rtt_s, self._least_rtt_s or rtt_s)

    def message(self, message: ToAgent, now: float) -> None:
        """Handles a message from the control channel."""
        if isinstance(message, ControlChanged):
            if 0 < message.number <= self._newest_control:
                return  # sent on two channels, and repeatedly
            self._newest_control = message.number
            if message.epoch >= self.downlink.epoch:
                self._holder.stick_fallback.turn(assistant_flies=message.assistant_flies)
                held = message.holder is not None
                self._person.holder_reported(held=held, present=message.holder_present, now=now)
            self._accept_epoch(message.epoch, now)
            self.downlink.raise_epoch(message.epoch)
            self._holder_present = message.holder_present
            if not message.holder_present:
                # The tower also orders a hold if one is due; two independent watches are safer than one.
                self._watch.loss.pilot_cut_off(now)
        elif isinstance(message, HoldOrder):
            if message.order_id <= self._newest_order:
                return  # sent on two channels, and repeatedly
            self._newest_order = message.order_id
            self._accept_epoch(message.epoch, now)
            self.downlink.raise_epoch(message.epoch)
            _log.warning("hold ordered: %s", message.reason)
            self._watch.used(now)
            self._failsafe.hold_now(
                HoldCause.ORDER, now, order_id=message.order_id, why=message.reason, interrupts=message.interrupts
            )
        elif isinstance(message, Stay):
            _log.warning("%s says: stay", message.by)
            self._person.stay(message.by, now)
        elif isinstance(message, SafetySettings):
            settings = within_limits(message)
            if settings != self._failsafe.settings:
                _log.info("safety settings: %s", settings)
            self._failsafe.settings = settings
        elif isinstance(message, StreamSettings):
            self.stream.chosen(message)
        elif isinstance(message, Transaction | CancelTransaction | MetadataWanted | NearbyZones):
            self._work_wanted(message, now)
        elif isinstance(message, LeaderPosition):
            self._work.leader(message, self._lateness.late_by(message.sent_ms, now), now)
        self._work.epoch(self.downlink.epoch, now)

    def _work_wanted(self, message: Transaction | CancelTransaction | MetadataWanted | NearbyZones, now: float) -> None:
        if isinstance(message, Transaction):
            self._accept_epoch(message.epoch, now)
            self.downlink.raise_epoch(message.epoch)
            self._work.epoch(self.downlink.epoch, now)
            late_s = 0.0 if message.sent_ms is None else self._lateness.late_by(message.sent_ms, now)
            if isinstance(message.work, FLIES) and late_s > self._failsafe.settings.commands_late_s:
                self._work.refuse(message, f"The command came {late_s:.1f} s late and was not carried out.")
                return
            if isinstance(message.work, FLIES) and late_s > now - self._failsafe.held_at:
                words = "The command was given before the drone was made to hold: it goes on holding."
                self._work.refuse(message, words)
                return
        self._work.message(message, now)
        # At once, so that a hold or a frame that arrives next is sent after it, not before.
        self._to_autopilot += self._work.due(now)

    def _accept_epoch(self, epoch: int, now: float) -> None:
        if epoch > self.downlink.epoch:
            self._failsafe.control_changed(now)

    def from_tower(self, content: Frames, now: float) -> None:
        """Processes frames from the data channel. Queues those that may pass for the autopilot."""
        late_s = self._lateness.late_by(content.sent_ms, now)
        for frame in self.downlink.admit(content):
            if not self._own.may_take(frame, now):
                self.counts[DropReason.OTHER_VEHICLE] += 1
                continue
            msgid = message_id(frame)
            if msgid in STICKS:
                self._watch.stick_age.came(late_s + self._least_rtt_s / 2.0, now, self._failsafe.settings)
            refused = too_late(msgid, late_s, self._failsafe.settings) or self._work.why_not(frame, now)
            if refused is None and msgid in INTERESTING:
                refused = self._holder.why_not(frame, now)
            if refused is not None:
                self.counts[refused] += 1
                continue
            passed, words = self._gestures.pass_on(frame, now) if msgid in STICKS else (frame, None)
            if words is not None:
                self._work.tell(words)
                self.autopilot.stick_gestures = self._gestures.held_back
            self._to_autopilot += [*self._work.ahead_of(frame, now), passed]
        self._work.epoch(self.downlink.epoch, now)

    @property
    def hands_on(self) -> bool:
        """Whether the holder is present, a hand was on the sticks, or the agent's centred sticks replace theirs. Only
        then must silence of the tower be detected at once."""
        ours = self.hold.sticks_on or self._holder.stick_fallback.on
        return self._holder_present or ours or self._watch.hand_on_sticks

    # Time and output

    def tick(self, now: float) -> None:
        """Advances time. Call it about every 25 ms."""
        self._autopilot_event(self.autopilot.tick(now), now)
        others = self._own.strangers(now)
        for system_id in set(others) - set(self.autopilot.other_systems):
            _log.warning("another autopilot, system %d, is on this line: make it a drone of its own", system_id)
        self.autopilot.other_systems = others
        self._to_autopilot += self._restart.due(now, self.hold)
        silent_s = self._presence.station_silent_s(now)
        self._failsafe.check(now, may_start=self._work.may_start, station_silent_s=silent_s)
        self._act_by_itself(now)
        self._to_autopilot += self._holder.sticks_to_keep(now, somebody_may_arm=self._holder_present)
        if self._restart.over:
            self._memory.keep(self._failsafe.record())
        view = self.autopilot
        self._stops.is_due = view.airborne(now)
        out = self._to_autopilot
        out += self._presence.due(
            now,
            vehicle_system_id=view.system_id,
            ground_station_system_id=self._inquiry.ground_station_system_id,
            holder_present=self._holder_present,
            tower_silent_s=self._watch.loss.silent_s(now),
            holds=self.hold.open,
        )
        if view.system_id is not None and view.heard:
            self._inquiry.follow(self.stream.profile)
            out += self._inquiry.due(now, vehicle_system_id=view.system_id)
            out += self._events.due(now, vehicle_system_id=view.system_id)
            out += self._answers.due(now, autopilot_kind=view.kind, vehicle_system_id=view.system_id)
        view.hears_agent = self._answers.hears(now)
        out += self._work.due(now)

    def frames_to_autopilot(self) -> list[bytes]:
        """Frames to write to the autopilot now, in order."""
        frames, self._to_autopilot = self._to_autopilot, []
        view = self.autopilot
        return self._stops.add(frames, autopilot_kind=view.kind, vehicle_system_id=view.system_id)

    def frames_to_tower(self, now: float) -> list[bytes]:
        """Returns autopilot frames that waited for their interval, and the agent's answers in the autopilot's name."""
        return [*self._work.pop_answers(), *self.stream.due(now)]

    def messages_to_tower(self, now: float, room: int = ROOM) -> list[ToTower]:
        """Returns messages for the control channel, in order. Without a link it returns none, and keeps hold progress.
        There are new ones if `has_news`, and at each tick.

        `room`: maximum number of messages that can wait for a later call.
        """
        self.has_news = False
        return self._outbox.take(now, room)
