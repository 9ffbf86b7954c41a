"""Everything the agent decides, between its two shells: the autopilot's port and the tower's link. No I/O.

Verbs in: what came from either side, and the time. What is to be sent is taken out with `take_to_autopilot` and
`take_to_tower`. The order of events is the order of calls; nothing here waits.
"""

import logging
from collections import Counter, deque
from typing import Any, Final

from onboard_agent.autopilot_state import AutopilotEvent, AutopilotView
from onboard_agent.downlink import SETUP_SIGNING, Downlink
from onboard_agent.flight_modes import flies_without_sticks, hold_mode
from onboard_agent.hold import Hold, HoldCause
from onboard_agent.intent import INTERESTING, Sticks, read_intent
from onboard_agent.link_loss import LinkLoss
from onboard_agent.own_frames import AGENT_COMPONENT, FrameMaker
from onboard_agent.parameters import Parameters
from onboard_agent.presence import Presence
from onboard_agent.rates import WATCHED, Rates
from onboard_agent.stick_gate import StickGate
from wire.content import Frames
from wire.control_messages import ControlChanged, HoldOrder, HoldProgress, ToAgent, ToTower, Welcome
from wire.dialect import decode, mavlink
from wire.frames import message_id, source
from wire.ids import DroneId, Epoch

_log = logging.getLogger(__name__)

PROGRESS_KEPT: Final = 32
"""Steps of a hold that wait for a link: four holds' worth. The oldest go first; what counts is how it ended."""

_READ: Final = frozenset(
    {
        mavlink.MAVLINK_MSG_ID_HEARTBEAT,
        mavlink.MAVLINK_MSG_ID_PARAM_VALUE,
        mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
        mavlink.MAVLINK_MSG_ID_COMMAND_ACK,
        mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
    }
)
"""The only messages whose payload we look at; everything else goes by unread."""


class Onboard:
    """One drone. `speaks_first`: the autopilot hears of us only when we have spoken."""

    def __init__(self, *, now: float, speaks_first: bool) -> None:
        maker = FrameMaker()
        self.autopilot = AutopilotView()
        self.downlink = Downlink()
        self.hold = Hold(maker)
        self.counts: Counter[str] = Counter()
        """Frames not passed on for reasons that the downlink does not know, by reason."""
        self._gate = StickGate()
        self._loss = LinkLoss(now)
        self._presence = Presence(maker, speaks_first=speaks_first)
        self._rates = Rates(maker)
        self._parameters = Parameters(maker)
        self._holder_present = False
        self._linked = False
        self._to_autopilot: list[bytes] = []
        self._progress: deque[HoldProgress] = deque(maxlen=PROGRESS_KEPT)

    # From the autopilot

    def from_autopilot(self, frames: list[bytes], now: float) -> list[bytes]:
        """Frames came from the autopilot's side; returns those that go to the tower."""
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
                if msgid == WATCHED:
                    self._rates.watched_came(now)
            if msgid in _READ:
                message = decode(frame)
                if message is not None:
                    self._read(message, msgid, system_id, component_id, now)
        return passed

    def _read(self, message: Any, msgid: int, system_id: int, component_id: int, now: float) -> None:
        view = self.autopilot
        event: AutopilotEvent | None = None
        if msgid == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            event = view.heartbeat(message, system_id, component_id, now)
            if view.is_autopilot(system_id, component_id):
                self.hold.heartbeat(armed=view.armed, custom_mode=view.custom_mode, now=now)
                if not view.armed:
                    self._gate.let_go()
        elif not view.is_autopilot(system_id, component_id):
            return
        elif msgid == mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT:
            event = view.global_position(message)
        elif msgid == mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE:
            view.extended_sys_state(message, now)
        elif msgid == mavlink.MAVLINK_MSG_ID_PARAM_VALUE:
            self._parameters.value(message)
        elif msgid == mavlink.MAVLINK_MSG_ID_COMMAND_ACK and self._is_ours(message):
            if message.command == mavlink.MAV_CMD_DO_SET_MODE:
                self.hold.acknowledged(message, now)
            else:
                self._rates.acknowledged(message, now)
        self._autopilot_event(event, now)

    def _is_ours(self, ack: Any) -> bool:
        """Whether an acknowledgement answers the agent, or does not say whom it answers."""
        return ack.target_system in (0, self.autopilot.system_id) and ack.target_component in (0, AGENT_COMPONENT)

    def _autopilot_event(self, event: AutopilotEvent | None, now: float) -> None:
        if event is None:
            return
        if event is AutopilotEvent.LOST:
            _log.warning("the autopilot is silent")
            return
        _log.info("autopilot %s: system %s, kind %d", event, self.autopilot.system_id, self.autopilot.kind)
        self._rates.ask_all(now)
        if self.autopilot.kind == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA:
            self._parameters.ask_all()

    # From the tower

    def welcomed(self, welcome: Welcome, now: float) -> None:
        """A new link is up."""
        self.downlink.new_link(DroneId(welcome.drone_id), Epoch(welcome.epoch))
        self._holder_present = welcome.holder_present
        self._linked = True
        self.autopilot.tell_again()
        self.tower_heard(now)

    def link_broken(self, now: float) -> None:
        """The link is down, whoever ended it."""
        self._linked = False
        self._holder_present = False
        self._loss.pilot_cut_off(now)

    def tower_heard(self, now: float) -> None:
        """An authentic datagram of the tower came."""
        self._loss.tower_heard(now)

    def message(self, message: ToAgent, now: float) -> None:
        """A message of the control channel came."""
        if isinstance(message, ControlChanged):
            self.downlink.raise_epoch(message.epoch)
            self._holder_present = message.holder_present
            if not message.holder_present:
                # The tower orders a hold too when it comes to it; two who watch are better than one.
                self._loss.pilot_cut_off(now)
        elif isinstance(message, HoldOrder):
            self.downlink.raise_epoch(message.epoch)
            _log.warning("hold ordered: %s", message.reason)
            self._begin_hold(HoldCause.ORDER, message.order_id, now)

    def from_tower(self, content: Frames, now: float) -> None:
        """Frames came over the data channel; those that may pass are due to the autopilot."""
        for frame in self.downlink.admit(content):
            if message_id(frame) in INTERESTING and not self._intent_passes(frame, now):
                self.counts["sticks not centred after a hold"] += 1
                continue
            self._to_autopilot.append(frame)

    def _intent_passes(self, frame: bytes, now: float) -> bool:
        intent = read_intent(frame, autopilot_kind=self.autopilot.kind, middles_us=self._parameters.channel_middles_us)
        if intent is None:
            return True
        if isinstance(intent, Sticks):
            if not self._gate.admit(intent):
                return False
            self.hold.sticks_taken_over()
            self._loss.sticks_passed(now)
            return True
        self.hold.overruled(needs_sticks=intent.needs_sticks, now=now)
        if not intent.needs_sticks:
            self._gate.let_go()
            self._loss.flies_without_sticks()
        return True

    # Time, and what is to be sent

    def tick(self, now: float) -> None:
        """Time has passed: every 25 ms or so."""
        self._autopilot_event(self.autopilot.tick(now), now)
        if self._loss.lost_by_hand(now) and self._flown_by_hand():
            _log.warning("the pilot was lost while flying by hand: holding")
            self._begin_hold(HoldCause.PILOT_LOST, 0, now)
        tower_silent_s = self._loss.silent_s(now)
        system_id = self.autopilot.system_id
        out = self._to_autopilot
        out += self.hold.tick(
            now,
            vehicle_system_id=system_id or 1,
            ground_station_system_id=self._parameters.ground_station_system_id,
            tower_silent_s=tower_silent_s,
        )
        out += self._presence.due(
            now,
            vehicle_system_id=system_id,
            ground_station_system_id=self._parameters.ground_station_system_id,
            holder_present=self._holder_present,
            tower_silent_s=tower_silent_s,
        )
        if system_id is not None and self.autopilot.heard:
            for request in (
                self._rates.due(now, vehicle_system_id=system_id),
                self._parameters.due(now, vehicle_system_id=system_id),
            ):
                if request is not None:
                    out.append(request)

    def take_to_autopilot(self) -> list[bytes]:
        """Frames to write to the autopilot now, in order."""
        frames, self._to_autopilot = self._to_autopilot, []
        return frames

    def take_to_tower(self, now: float) -> list[ToTower]:
        """Messages for the control channel, in order; nothing while there is no link, but progress is kept for it."""
        for step in self.hold.take_progress():
            _log.info("hold: %s %s", step.step, step.detail)
            self._progress.append(step)
        if not self._linked:
            return []
        messages: list[ToTower] = list(self._progress)
        self._progress.clear()
        state = self.autopilot.changed(now)
        if state is not None:
            messages.append(state)
        return messages

    def _flown_by_hand(self) -> bool:
        view = self.autopilot
        return view.armed and not flies_without_sticks(view.kind, view.custom_mode)

    def _begin_hold(self, cause: HoldCause, order_id: int, now: float) -> None:
        view = self.autopilot
        needed = view.armed or not view.heard
        if needed:
            self._gate.close()
        self._loss.flies_without_sticks()
        self.hold.begin(
            cause=cause,
            order_id=order_id,
            epoch=self.downlink.epoch,
            mode=hold_mode(view.kind, view.vehicle_type),
            needed=needed,
            now=now,
        )
