"""Requests to the autopilot about its flight logs, and their timing. Pure."""

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
    """Times in seconds, sizes in bytes, and counts, depending on the line to the autopilot."""

    first_s: float
    """Timeout for the first answer, because an autopilot searches its card first."""
    quiet_s: float
    """After this silence the autopilot has stopped sending."""
    settle_s: float
    """Wait for pieces that arrive out of order."""
    window: int
    """Bytes requested at once, a multiple of CHUNK."""
    tries: int = 8
    """Consecutive requests without data before it gives up."""


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
        """LOG_REQUEST_END: the autopilot may resume its normal work."""
        return self._frame(mavlink.MAVLink_log_request_end_message(*self._target))

    @property
    def _target(self) -> tuple[int, int]:
        return self._system, _AUTOPILOT_COMPONENT

    def _frame(self, message: Any) -> bytes:
        return self._maker.make(message, agent_sender(self._system))
