"""Requests to the autopilot about its parameters, and their timing. Pure."""

from dataclasses import dataclass
from typing import Any, Final

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, read_parameter
from onboard_agent.transactions.parameter_encoding import Encoding, ParameterSetting
from wire.dialect import mavlink

_AUTOPILOT_COMPONENT: Final = 1


@dataclass(frozen=True, slots=True)
class Pace:
    """Times in seconds, and counts, depending on the line to the autopilot."""

    recall_after_s: float
    """Wait for the chip number."""
    list_after_s: float
    """Wait after the autopilot came: stream rates and failsafe parameters are requested first."""
    first_s: float
    """Timeout for the first value of a list: an autopilot may have to count its parameters."""
    quiet_s: float
    """After this silence a list has ended; it may share the line with telemetry."""
    answer_s: float
    """First and longest timeout for a single value or a block of a file; measured answers shorten it."""
    at_once: int
    """Single values requested at the same time. ArduPilot queues 20 such requests, and drops the rest."""
    blocks_at_once: int
    """File blocks requested at the same time. ArduPilot queues five file requests, from all clients together."""
    tries: int = 5
    name_tries: int = 2
    """For a name that is not in the list: most autopilots do not answer for an unknown name, and a file may hold many
    of them."""
    gap_tries: int = 8
    """For a single value missing from a list: hundreds may be missing, and one that never arrives fails the list."""


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
        """PARAM_REQUEST_READ by index."""
        return self._frame(mavlink.MAVLink_param_request_read_message(self._system, _AUTOPILOT_COMPONENT, b"", index))

    def ask_name(self, name: str) -> bytes:
        """PARAM_REQUEST_READ by name."""
        return self._frame(read_parameter(self._system, name))

    def set(self, name: str, value: float, kind: int) -> bytes:
        """PARAM_SET."""
        return self._frame(ParameterSetting(self._system, name, value, kind, self.encoding))

    def _frame(self, message: Any) -> bytes:
        return self._maker.make(message, agent_sender(self._system))
