"""The two paths of a frame through the tower: from the agent to viewers, from the pilot to the agent."""

from typing import Final

from server.airspace.core.aircraft.decode import ADSB_VEHICLE
from server.airspace.core.aircraft.decode import READ as AIRCRAFT
from server.airspace.core.zones.check import warn, zones_of_frame
from server.alerts.core.kept_telemetry import KEPT, REMOTE_ID_STATUS, STATUSTEXT, autopilot_of
from server.control.core.frame_refusals import denied_command
from server.control.core.loan_check import barred_by_loan
from server.control.core.loan_limits import home_in
from server.control.core.loan_tables import MOTION
from server.control.core.policy import (
    CommandSeen,
    Kind,
    Permission,
    changes_the_flight,
    command_in,
    ends_the_flight,
    kind_of,
    permission_for,
    refusal_of,
)
from server.flights.core.recorder import FlightRecorder
from server.kernel.people import UserRef
from server.link.core.flood_gate import FloodGate
from server.link.core.noise_watch import LimitedTelemetry
from server.link.core.viewport import POSITION, place_in
from server.live.browser import Browser
from server.live.hub_events import TurnRequested
from server.live.live_drone import LiveDrone
from server.live.live_state import LiveState
from server.operations.core.observed_commands import ObservedCommands
from server.operations.core.observed_table import ANSWERS
from wire.content import Frames
from wire.dialect import EVENT, mavlink
from wire.drops import Dropped, DropReason
from wire.frames import MalformedFrame, checksum_holds, is_known, message_id
from wire.ids import DroneId
from wire.state_messages import StateKey, state_key
from wire.tagged import MAX_UPWARD_MESSAGE_BYTES, split_stamp, split_tagged, tag

_AUTOPILOT: Final = mavlink.MAV_COMP_ID_AUTOPILOT1
_HEARTBEAT: Final = mavlink.MAVLINK_MSG_ID_HEARTBEAT
_HOME_POSITION: Final = mavlink.MAVLINK_MSG_ID_HOME_POSITION
_SETUP_SIGNING: Final = mavlink.MAVLINK_MSG_ID_SETUP_SIGNING


class RefusedByLoan(Dropped):
    """`words`: which limit, as `words_of` has it."""

    def __init__(self, words: str) -> None:
        super().__init__(DropReason.LOAN)
        self.words = words


class RefusedByZone(Dropped):
    """`words`: which zone."""

    def __init__(self, words: str) -> None:
        super().__init__(DropReason.ZONE)
        self.words = words


class FramePaths:
    """No state of its own: all of it is in the drones and the browsers."""

    def __init__(self, state: LiveState, flood: FloodGate, observed: ObservedCommands, flights: FlightRecorder) -> None:
        self._state = state
        self._flights = flights
        self._observed = observed
        self._flood = flood

    def up(self, drone: LiveDrone, content: Frames, now: float) -> None:
        """Frames of the drone's own link. Raises Dropped for a tag of another drone."""
        if content.drone_id != drone.record.id:
            raise Dropped(DropReason.FOREIGN_TAG)
        drone_id, frames, own = content.drone_id, content.frames, drone.own
        self._state.traffic.frames_from_agents += len(frames)
        drone.noise.frames += len(frames)
        watchers = drone.watchers.values() if not drone.lease.view_taken else drone.frame_watchers()
        if not self._flood.admits_all(drone_id, len(frames), now):
            frames, state_dropped, lost = self._flood.admitted(drone_id, frames, now)
            self._state.drops[DropReason.FLOOD] += state_dropped + lost
            for browser in watchers:
                browser.outbox.lose(drone_id, lost)
        came = len(frames)
        frames = [frame for frame in frames if own.counts(frame, now)]
        if len(frames) != came:
            self._state.drops[DropReason.OTHER_VEHICLE] += came - len(frames)
        # What is the newest of something, and what must arrive: apart from here on, each in order.
        state: list[tuple[StateKey, bytes]] = []
        transactional: list[bytes] = []
        tag_bytes = tag(drone_id, b"")
        is_asked, is_muted = self._observed.waits(drone_id), drone.is_muted
        has_secret = False
        if drone.is_limited:
            drone.limited = drone.limited or LimitedTelemetry(now)
            all_came = len(frames)
            frames, lost = drone.limited.admitted(frames, now)
            self._state.drops[DropReason.FLOOD] += all_came - len(frames)
            for browser in watchers:
                browser.outbox.lose(drone_id, lost)
        to_pilot: list[bytes] = []
        """Texts of a muted drone."""
        for frame in frames:
            key = state_key(frame)
            if key is None:
                kind = message_id(frame)
                if kind == _SETUP_SIGNING:
                    self._state.drops[DropReason.NOT_ALLOWED] += 1
                    has_secret = True
                    continue
                if kind in AIRCRAFT:
                    self._state.aircraft_frames.put(drone_id, (frame, now))
                if is_asked and kind in ANSWERS:
                    self._observed.heard(drone_id, frame, now)
                if kind == EVENT:
                    drone.telemetry.event(frame)
                if kind == REMOTE_ID_STATUS:
                    drone.telemetry.remote_id_status(frame, now)
                if kind == STATUSTEXT:
                    drone.telemetry.text(frame, now, armed=bool(drone.armed))
                if kind in (EVENT, STATUSTEXT):
                    drone.noise.texts += 1
                    if is_muted:
                        to_pilot.append(tag_bytes + frame)
                        continue
                transactional.append(tag_bytes + frame)
                continue
            state.append((key, tag_bytes + frame))
            msgid = key[2]
            if msgid == POSITION:
                drone.position_frame, drone.position_at = frame, now
                if place_in(frame) is not None:
                    drone.placed_frame, drone.placed_at = frame, now
            elif msgid == _HOME_POSITION and (home := home_in(frame)) is not None:
                drone.home, drone.has_reported_home = home, True
            elif msgid == _HEARTBEAT and key[1] == _AUTOPILOT:
                drone.heartbeat, drone.heartbeat_at = frame, now
                drone.telemetry.autopilot = autopilot_of(frame)
            elif msgid == ADSB_VEHICLE:
                self._state.aircraft_frames.put(drone_id, (frame, now))
            elif msgid in KEPT and key[1] == _AUTOPILOT:
                drone.telemetry.newest[msgid, key[3]] = frame
        for browser in watchers:
            browser.offer(drone_id, state, transactional)
            if to_pilot and drone.may_arm(browser.viewer.user_id):
                browser.offer(drone_id, (), to_pilot)
        if drone.tape is not None:
            if has_secret:
                frames = [frame for frame in frames if message_id(frame) != _SETUP_SIGNING]
            drone.tape.add(frames, now)

    def down(self, browser: Browser, message: bytes, now: float) -> None:
        """A binary message of a browser: checks each frame in turn, passes on what may pass, answers the rest."""
        try:
            if len(message) > MAX_UPWARD_MESSAGE_BYTES:
                raise MalformedFrame("too long")
            sent_ms, tagged = split_stamp(message)
            parts = split_tagged(tagged)
        except MalformedFrame:
            admitted = self._flood.admits(browser.viewer.user_id, None, flies=False, now=now)
            self._state.refuse(browser, DropReason.MALFORMED if admitted else DropReason.FLOOD, None, now)
            return
        self._state.traffic.frames_from_browsers += len(parts)
        at_most_s = browser.trip.late_at_most_s(now)
        late_s = 0.0 if sent_ms is None else browser.lateness.late_by(sent_ms, now, at_most_s=at_most_s)
        for drone_id, frame in parts:
            try:
                self._frame_down(browser, drone_id, frame, late_s, now)
            except Dropped as dropped:
                words = dropped.words if isinstance(dropped, RefusedByLoan | RefusedByZone) else ""
                self._state.refuse(browser, dropped.reason, drone_id, now, words)
                if dropped.reason is not DropReason.FLOOD:  # which must not become a flood of answers
                    self._answer(browser, drone_id, frame, dropped.reason)

    def _frame_down(self, browser: Browser, drone_id: DroneId, frame: bytes, late_s: float, now: float) -> None:
        drone = self._state.drones.get(drone_id)
        user_id = browser.viewer.user_id
        # One that is not there and one that is not theirs fail the same check, before anything else is looked at.
        if drone is None or browser.number not in drone.watchers:
            admitted = self._flood.admits(user_id, None, flies=False, now=now)
            raise Dropped(DropReason.UNKNOWN_DRONE if admitted else DropReason.FLOOD)
        standing = drone.authorization_of(browser.viewer)
        if not self._flood.admits(user_id, drone_id, flies=standing.has_turn, now=now):
            raise Dropped(DropReason.FLOOD)
        if is_known(frame) and not checksum_holds(frame):
            raise Dropped(DropReason.BAD_FRAME)
        if not drone.own.may_take(frame, now):
            raise Dropped(DropReason.OTHER_VEHICLE)
        command = command_in(frame)
        reason = refusal_of(frame, command, standing)
        if reason is not None:
            raise Dropped(reason)
        barred = barred_by_loan(drone, browser.viewer, frame, command)
        if barred is not None:
            raise RefusedByLoan(barred)
        if drone.zones:
            self._check_zones(drone, frame, command)
        kind = kind_of(frame)
        safety = drone.safety
        if late_s > (safety.sticks_late_s if kind is Kind.STICKS else safety.commands_late_s):
            raise Dropped(DropReason.LATE)
        if drone.link is None or not drone.link.is_heard(now):
            raise Dropped(DropReason.OFFLINE)
        reads_only = permission_for(frame, command) is Permission.WATCHER
        if not reads_only:
            if drone.fenced or drone.ignores_holder(user_id, now):
                raise Dropped(DropReason.NOT_IN_CONTROL)
            if command is not None and ends_the_flight(command, standing):
                self._require_repeat(browser, drone_id, command, now)
            if drone.lease.assistant is not None and not self._turn_allows(drone, user_id, frame, now):
                self._observe(browser, drone_id, frame, kind, now)  # it waits, and goes when the turn has come
                return
        if kind is Kind.STICKS and drone.other_hands_of(browser, now):
            raise Dropped(DropReason.OTHER_HANDS)
        if not drone.link.send_frames(drone.lease.epoch, (frame,), now):
            raise Dropped(DropReason.OFFLINE)
        self._state.traffic.frames_to_agents += 1
        if drone.tape is not None:
            drone.tape.add((frame,), now)
        drone.commanded += changes_the_flight(frame, command)
        if not reads_only:
            self._observe(browser, drone_id, frame, kind, now)
        if message_id(frame) in MOTION:
            drone.zone_watch.setpoints_at = now
        if kind is Kind.STICKS:
            drone.sticks_at = self._state.sticks_at = now
            drone.sticks_from = browser.number
            self._flights.sticks(drone, user_id, browser.viewer.name, now)

    @staticmethod
    def _check_zones(drone: LiveDrone, frame: bytes, command: CommandSeen | None) -> None:
        hits = zones_of_frame(drone, frame, command)
        refused = next((hit for hit in hits if hit.zone.binds), None)
        if refused is not None:
            raise RefusedByZone(f"{refused.words}.")
        warn(drone, hits)

    def _observe(self, browser: Browser, drone_id: DroneId, frame: bytes, kind: Kind, now: float) -> None:
        """For the audit trail, after the frame was sent."""
        if kind is Kind.COMMAND:
            by = UserRef(browser.viewer.user_id, browser.viewer.name)
            self._observed.sent(drone_id, by, browser.address, frame, now)

    @staticmethod
    def _require_repeat(browser: Browser, drone_id: DroneId, command: CommandSeen, now: float) -> None:
        if not browser.repeat_confirmation.confirms(drone_id, command, now):
            raise Dropped(DropReason.ASK_TWICE)

    def _turn_allows(self, drone: LiveDrone, user_id: int, frame: bytes, now: float) -> bool:
        """While an admin assists. False: the frame waits for the turn. Raises Dropped for the holder out of turn."""
        turn = drone.turn
        assistant = drone.lease.assistant
        if assistant is not None and user_id == assistant.id:
            before = turn.wanted
            if turn.assistant_frame(frame, now):
                return True
            if before != turn.wanted:
                self._state.on_event(TurnRequested(drone.drone_id, "assistant"))
            return False
        if turn.whose != "holder" or turn.wanted != "holder":
            raise Dropped(DropReason.ASSISTED)
        return True

    def _answer(self, browser: Browser, drone_id: DroneId, frame: bytes, reason: DropReason) -> None:
        """A refused command is answered in MAVLink too, so that any program sees it. Only for drones they may see."""
        drone = self._state.drones.get(drone_id)
        command = command_in(frame)
        if drone is None or command is None or browser.number not in drone.watchers:
            return
        browser.offer(drone_id, (), (tag(drone_id, denied_command(frame, command, reason)),))
