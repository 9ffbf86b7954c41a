"""Which messages the agent requests from the autopilot, and at which rates. No I/O.

ArduPilot sends little but its heartbeat until it is asked, and forgets requests when it reboots. On a narrow line
(serial) the agent requests no more than the stream profile forwards, but thinning does not depend on that.
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
"""The autopilot is alive, but the fastest message that it granted is missing: another program changed the rate, or it
rebooted."""

ASK_AGAIN_AFTER_S: Final = 30.0
"""At most this often for that reason, so that two who disagree do not fight."""


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
    RateRequest(mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT, 5),
    RateRequest(mavlink.MAVLINK_MSG_ID_BATTERY_STATUS, 0.5),
    RateRequest(mavlink.MAVLINK_MSG_ID_HOME_POSITION, 0.2),
    RateRequest(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT, 1),
    RateRequest(mavlink.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT, 1),
    RateRequest(mavlink.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT, 1),
    RateRequest(mavlink.MAVLINK_MSG_ID_RC_CHANNELS, 2),
    RateRequest(mavlink.MAVLINK_MSG_ID_WIND, 1),
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
"""What the agent itself needs, whatever goes up: never requested at lower rates."""

WATCHED: Final = mavlink.MAVLINK_MSG_ID_ATTITUDE

_RATE_OF: Final = {request.message_id: request.rate_hz for request in RATE_REQUESTS}


class Rates:
    """Call `ask_all` when the autopilot appears or has rebooted, `due` at each tick, `acknowledged` for each ACK."""

    def __init__(self, maker: FrameMaker, *, narrow_line: bool = False) -> None:
        self._maker = maker
        self._narrow_line = narrow_line
        self._profile = StreamProfile.FULL
        self._asking: Asking[RateRequest] = Asking(timeout_s=ANSWER_WITHIN_S, tries=TRIES)
        self._unsupported: set[int] = set()
        self._granted: dict[int, float] = {}
        self._watched_granted = False
        self._watched_at = 0.0
        self._asked_all_at = 0.0
        self._came_at: dict[int, float] = {}
        self._checked_at = 0.0

    @property
    def unsupported(self) -> frozenset[int]:
        """Messages that this autopilot has refused; they are not requested again."""
        return frozenset(self._unsupported)

    def ask_all(self, now: float) -> None:
        """From the beginning of the table."""
        self._asked_all_at = self._checked_at = now
        self._watched_granted = False
        self._granted.clear()
        self._came_at.clear()
        self._ask_what_differs()

    def follow(self, profile: StreamProfile) -> None:
        """The present stream profile. Rates already granted are not requested again."""
        if self._narrow_line and profile is not self._profile:
            self._profile = profile
            self._ask_what_differs()

    def _ask_what_differs(self) -> None:
        requests = [request._replace(rate_hz=self._wanted_hz(request)) for request in RATE_REQUESTS]
        self._asking.ask(
            request
            for request in requests
            if request.message_id not in self._unsupported and self._granted.get(request.message_id) != request.rate_hz
        )

    def _wanted_hz(self, request: RateRequest) -> float:
        """Never below what a pilot needs: a pilot who takes the sticks must not wait for new rates."""
        if request.message_id in _READ_HERE:
            return request.rate_hz
        return min(request.rate_hz, rate_hz(self._profile, request.message_id, by_hand=True))

    def heard(self, message_id: int, now: float) -> None:
        """Any message of the autopilot came."""
        if message_id in _RATE_OF:
            self._came_at[message_id] = now
            if message_id == WATCHED:
                self._watched_at = now

    def due(self, now: float, *, vehicle_system_id: int) -> bytes | None:
        """A request to send now."""
        if (
            self._watched_granted
            and now - self._watched_at > MISSED_FOR_S
            and now - self._asked_all_at > ASK_AGAIN_AFTER_S
        ):
            self.ask_all(now)
        if now - self._checked_at > ASK_AGAIN_AFTER_S:
            self._checked_at = now
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
        """Messages that do not arrive although none was refused. An answer names its command but not the message, so a
        late one may have been taken for the next; and a busy autopilot may not have answered at all."""
        missing = []
        for request in RATE_REQUESTS:
            period_s = 1.0 / self._wanted_hz(request) if request.rate_hz else float("inf")
            silent_s = now - self._came_at.get(request.message_id, float("-inf"))
            if request.message_id not in self._unsupported and silent_s > max(MISSED_FOR_S, 3.0 * period_s):
                missing.append(request._replace(rate_hz=self._wanted_hz(request)))
        return missing

    def acknowledged(self, ack: Any, now: float) -> None:
        """A COMMAND_ACK of the autopilot that is meant for us."""
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
