"""Requests messages from the autopilot at the rates that the agent needs. No I/O.

ArduPilot sends little but its heartbeat until requested, and forgets requests when it reboots. On a narrow line
(serial) the agent requests no more than the stream profile sends to the tower, but the thinner does not rely on it.
"""

from typing import Any, Final, NamedTuple

from onboard_agent.autopilot.asking import Asking
from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, request_message, set_message_interval
from wire.dialect import mavlink
from wire.stream_profiles import StreamProfile, rate_hz

ANSWER_WITHIN_S: Final = 0.5
TRIES: Final = 3
IN_PROGRESS_WAIT_S: Final = 2.0

MISSED_FOR_S: Final = 5.0
"""If the fastest granted message is missing for this long, another party changed the rate or the autopilot rebooted."""

ASK_AGAIN_AFTER_S: Final = 7.0
MAX_ASK_AGAIN_S: Final = 30.0
"""Minimum interval of such repeats: it doubles from the first to the second, so that two parties that disagree do not
compete. The first is short: an autopilot may reboot soon after it was found, and one that boots answers late."""


class RateRequest(NamedTuple):
    """A message, and its rate in Hz; 0 for once."""

    message_id: int
    rate_hz: float


RATE_REQUESTS: Final[tuple[RateRequest, ...]] = (
    RateRequest(mavlink.MAVLINK_MSG_ID_ATTITUDE, 10),
    RateRequest(mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, 5),
    RateRequest(mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, 1),
    RateRequest(mavlink.MAVLINK_MSG_ID_VFR_HUD, 4),
    RateRequest(mavlink.MAVLINK_MSG_ID_SYS_STATUS, 1),
    RateRequest(mavlink.MAVLINK_MSG_ID_GPS_RAW_INT, 1),
    RateRequest(mavlink.MAVLINK_MSG_ID_GPS2_RAW, 1),  # sent only where there are two
    RateRequest(mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT, 5),
    RateRequest(mavlink.MAVLINK_MSG_ID_BATTERY_STATUS, 0.5),
    RateRequest(mavlink.MAVLINK_MSG_ID_HOME_POSITION, 0.2),
    RateRequest(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT, 1),
    RateRequest(mavlink.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT, 1),
    RateRequest(mavlink.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT, 1),
    RateRequest(mavlink.MAVLINK_MSG_ID_RC_CHANNELS, 2),
    RateRequest(mavlink.MAVLINK_MSG_ID_WIND, 1),
    RateRequest(mavlink.MAVLINK_MSG_ID_VIBRATION, 0.5),
    RateRequest(mavlink.MAVLINK_MSG_ID_FENCE_STATUS, 1),
    # Sent only while a compass is calibrated.
    RateRequest(mavlink.MAVLINK_MSG_ID_MAG_CAL_PROGRESS, 4),
    RateRequest(mavlink.MAVLINK_MSG_ID_MAG_CAL_REPORT, 1),
    RateRequest(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION, 0),
)

_READ_HERE: Final = frozenset(
    {
        mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
        mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
        mavlink.MAVLINK_MSG_ID_SYS_STATUS,
        mavlink.MAVLINK_MSG_ID_RC_CHANNELS,
        mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT,
    }
)
"""Messages that the agent itself needs, whatever goes to the tower: never requested at a lower rate."""

RESEARCH: Final = {
    mavlink.MAVLINK_MSG_ID_ATTITUDE: 10.0,
    mavlink.MAVLINK_MSG_ID_RC_CHANNELS: 2.0,
    mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 1.0,
}
"""What the black box may have faster: attitude with its rates, sticks and outputs. In Hz: what of it goes to the tower
all the same."""

WATCHED: Final = mavlink.MAVLINK_MSG_ID_ATTITUDE

_ASKED: Final = frozenset(request.message_id for request in RATE_REQUESTS)


class Rates:
    """Call `ask_all` when the autopilot appears or has rebooted, `due` at each tick, `acknowledged` for each ACK."""

    def __init__(self, maker: FrameMaker, *, narrow_line: bool = False, research_hz: float = 0.0) -> None:
        """`research_hz`: of the messages in `RESEARCH`, whatever the stream profile says; 0: as usual."""
        self._maker = maker
        self._research_hz = research_hz
        usual = [one for one in RATE_REQUESTS if not research_hz or one.message_id not in RESEARCH]
        faster = [RateRequest(message_id, research_hz) for message_id in RESEARCH] if research_hz else []
        self._requests = (*faster, *usual)
        self._narrow_line = narrow_line
        self._profile = StreamProfile.FULL
        self._asking: Asking[RateRequest] = Asking(timeout_s=ANSWER_WITHIN_S, tries=TRIES)
        self._unsupported: set[int] = set()
        self._granted: dict[int, float] = {}
        self._watched_granted = False
        self._watched_at = 0.0
        self._asked_all_at = 0.0
        self._came_at: dict[int, float] = {}
        self._check_at = 0.0
        self._ask_again_s = ASK_AGAIN_AFTER_S

    @property
    def unsupported(self) -> frozenset[int]:
        """Messages that this autopilot has refused; they are not requested again."""
        return frozenset(self._unsupported)

    def ask_all(self, now: float) -> None:
        """Requests all messages, from the beginning of the table."""
        self._ask_again_s = ASK_AGAIN_AFTER_S
        self._ask_all(now)

    def _ask_all(self, now: float) -> None:
        self._asked_all_at, self._check_at = now, now + self._ask_again_s
        self._watched_granted = False
        self._granted.clear()
        self._came_at.clear()
        self._ask_what_differs()

    def follow(self, profile: StreamProfile) -> None:
        """Sets the stream profile. Rates that the autopilot has already granted are not requested again."""
        if self._narrow_line and profile is not self._profile:
            self._profile = profile
            self._ask_what_differs()

    def _ask_what_differs(self) -> None:
        requests = [request._replace(rate_hz=self._wanted_hz(request)) for request in self._requests]
        self._asking.ask(
            request
            for request in requests
            if request.message_id not in self._unsupported and self._granted.get(request.message_id) != request.rate_hz
        )

    def _wanted_hz(self, request: RateRequest) -> float:
        """Returns at least the rate that a pilot needs: a person who takes the sticks must not wait for a request."""
        if request.message_id in _READ_HERE or (self._research_hz and request.message_id in RESEARCH):
            return request.rate_hz
        return min(request.rate_hz, rate_hz(self._profile, request.message_id, by_hand=True))

    def heard(self, message_id: int, now: float) -> None:
        """Any message of the autopilot arrived."""
        if message_id in _ASKED or message_id in RESEARCH:
            self._came_at[message_id] = now
            if message_id == WATCHED:
                self._watched_at = now

    def due(self, now: float, *, vehicle_system_id: int) -> bytes | None:
        """Returns a request to send now, or None."""
        if (
            self._watched_granted
            and now - self._watched_at > MISSED_FOR_S
            and now - self._asked_all_at > self._ask_again_s
        ):
            self._ask_again_s = min(2.0 * self._ask_again_s, MAX_ASK_AGAIN_S)
            self._ask_all(now)
        if now > self._check_at:
            self._check_at = now + MAX_ASK_AGAIN_S
            if self._asking.current is None:
                self._asking.ask(self._missing(now))
        question = self._asking.due(now)
        if question is None:
            return None
        request, asked = question
        if request.rate_hz:
            message = set_message_interval(
                vehicle_system_id, request.message_id, round(1e6 / request.rate_hz), confirmation=asked
            )
        else:
            message = request_message(vehicle_system_id, request.message_id, confirmation=asked)
        return self._maker.make(message, agent_sender(vehicle_system_id))

    def _missing(self, now: float) -> list[RateRequest]:
        """Returns the messages that do not arrive although they were not refused. An acknowledgement names its command
        but not the message, so a late one may have counted for the next; a busy autopilot may not respond at all."""
        missing = []
        for request in self._requests:
            period_s = 1.0 / self._wanted_hz(request) if request.rate_hz else float("inf")
            silent_s = now - self._came_at.get(request.message_id, float("-inf"))
            if request.message_id not in self._unsupported and silent_s > max(MISSED_FOR_S, 3.0 * period_s):
                missing.append(request._replace(rate_hz=self._wanted_hz(request)))
        return missing

    def acknowledged(self, ack: Any, now: float) -> None:
        """Handles a COMMAND_ACK that is addressed to the agent."""
        request = self._asking.current
        if request is None:
            return
        command = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL if request.rate_hz else mavlink.MAV_CMD_REQUEST_MESSAGE
        if ack.command != command:
            return
        if ack.result == mavlink.MAV_RESULT_IN_PROGRESS:
            self._asking.wait_longer(now, IN_PROGRESS_WAIT_S)
        elif ack.result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED:
            self._asking.wait_longer(now, ANSWER_WITHIN_S)
        else:
            if ack.result in (mavlink.MAV_RESULT_UNSUPPORTED, mavlink.MAV_RESULT_DENIED):
                self._unsupported.add(request.message_id)
            elif ack.result == mavlink.MAV_RESULT_ACCEPTED:
                self._granted[request.message_id] = request.rate_hz
                if request.message_id == WATCHED:
                    self._watched_granted = True
                    self._watched_at = now
            self._asking.answered()
