"""Requests to the autopilot about its flight logs, and how often to repeat them. Pure."""

from dataclasses import dataclass
from typing import Any, Final

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender
from wire.dialect import mavlink

CHUNK: Final = 90
"""Bytes of a log in one LOG_DATA."""
ALL: Final = (0, 0xFFFF)

_AUTOPILOT_COMPONENT: Final = 1


@dataclass(frozen=True, slots=True)
class LogPace:
    """Seconds, bytes and numbers, by the line to the autopilot."""

    first_s: float
    """For the first answer: an autopilot looks through its card."""
    quiet_s: float
    """A transfer that is silent for this long has stopped."""
    settle_s: float
    """What was overtaken may still come."""
    window: int
    """Bytes per request, a multiple of CHUNK."""
    tries: int = 8
    """Questions in a row that bring nothing."""


LOGS_FAST: Final = LogPace(first_s=2.0, quiet_s=0.25, settle_s=0.02, window=512 * CHUNK)
LOGS_NARROW: Final = LogPace(first_s=4.0, quiet_s=2.0, settle_s=0.2, window=128 * CHUNK)


class LogFrames:
    """Makes the frames for one vehicle."""

    def __init__(self, maker: FrameMaker, *, vehicle_system_id: int) -> None:
        self._maker = maker
        self._system = vehicle_system_id

    def ask_list(self, first: int, last: int) -> bytes:
        """LOG_REQUEST_LIST."""
        return self._frame(mavlink.MAVLink_log_request_list_message(*self._target, first, last))

    def ask_data(self, log_id: int, offset: int, count: int) -> bytes:
        """LOG_REQUEST_DATA."""
        return self._frame(mavlink.MAVLink_log_request_data_message(*self._target, log_id, offset, count))

    def enough(self) -> bytes:
        """LOG_REQUEST_END: it may go on with what it does."""
        return self._frame(mavlink.MAVLink_log_request_end_message(*self._target))

    @property
    def _target(self) -> tuple[int, int]:
        return self._system, _AUTOPILOT_COMPONENT

    def _frame(self, message: Any) -> bytes:
        return self._maker.make(message, agent_sender(self._system))
