"""Requests to the autopilot about its parameters, and how often to repeat them. Pure."""

from dataclasses import dataclass
from typing import Any, Final

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, read_parameter
from onboard_agent.transactions.parameter_encoding import Encoding, ParameterSetting
from wire.dialect import mavlink

_AUTOPILOT_COMPONENT: Final = 1


@dataclass(frozen=True, slots=True)
class Pace:
    """Seconds and numbers, by the line to the autopilot."""

    recall_after_s: float
    """So long is waited for the number of the chip."""
    list_after_s: float
    """Counted from the autopilot's first heartbeat: message rates and failsafe parameters come first."""
    first_s: float
    """For the first value of a list: an autopilot may have to count them."""
    quiet_s: float
    """A list that is silent for this long has ended; it may share the line with telemetry."""
    answer_s: float
    """For a single value or block of a file, before it is known how long they take; and never longer."""
    at_once: int
    """Single values requested at the same time. ArduPilot queues 20 such requests, and drops the rest."""
    blocks_at_once: int
    """For a file. ArduPilot queues five requests, of all clients together."""
    tries: int = 5
    name_tries: int = 2
    """For a name outside the list: most autopilots do not answer for an unknown one, and a file may be full of them."""
    gap_tries: int = 8
    """For a value missing from a list: there may be hundreds, and one that stays away spoils the list."""


FAST: Final = Pace(
    recall_after_s=0.9,
    list_after_s=1.0,
    first_s=1.5,
    quiet_s=0.25,
    answer_s=0.5,
    at_once=12,
    blocks_at_once=4,
)
NARROW: Final = Pace(
    recall_after_s=5.0,
    list_after_s=10.0,
    first_s=3.0,
    quiet_s=2.0,
    answer_s=1.5,
    at_once=2,
    blocks_at_once=2,
)


class ParameterFrames:
    """Makes the frames for one vehicle."""

    def __init__(self, maker: FrameMaker, *, vehicle_system_id: int, encoding: Encoding) -> None:
        self._maker = maker
        self._system = vehicle_system_id
        self.encoding = encoding

    def ask_all(self) -> bytes:
        """PARAM_REQUEST_LIST."""
        return self._frame(mavlink.MAVLink_param_request_list_message(self._system, _AUTOPILOT_COMPONENT))

    def ask_index(self, index: int) -> bytes:
        """PARAM_REQUEST_READ by the number in the list."""
        return self._frame(mavlink.MAVLink_param_request_read_message(self._system, _AUTOPILOT_COMPONENT, b"", index))

    def ask_name(self, name: str) -> bytes:
        """PARAM_REQUEST_READ by name."""
        return self._frame(read_parameter(self._system, name))

    def set(self, name: str, value: float, kind: int) -> bytes:
        """PARAM_SET."""
        return self._frame(ParameterSetting(self._system, name, value, kind, self.encoding))

    def _frame(self, message: Any) -> bytes:
        return self._maker.make(message, agent_sender(self._system))
