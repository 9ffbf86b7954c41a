"""The few parameters of the autopilot that the failsafe needs, read one by one. No I/O.

ArduPilot takes sticks only from the sysid that it is told is the ground station, and the middle of the throttle
channel is between its ends, not where its trim is.
"""

from math import isfinite
from typing import Any, Final

from onboard_agent.asking import Asking
from onboard_agent.own_frames import FrameMaker, agent_sender, read_parameter

ANSWER_WITHIN_S: Final = 1.0
TRIES: Final = 3

GROUND_STATION_NAMES: Final = ("SYSID_MYGCS", "MAV_GCS_SYSID")
"""Until ArduPilot 4.6, and from 4.7 on."""

NAMES: Final = (*GROUND_STATION_NAMES, "RC1_TRIM", "RC2_TRIM", "RC3_MIN", "RC3_MAX", "RC4_TRIM")

_MIDDLE_US: Final = 1500
_STANDARD_GROUND_STATION: Final = 255


class Parameters:
    """Call `ask_all` when an ArduPilot appears, `due` at each tick, `value` for each PARAM_VALUE."""

    def __init__(self, maker: FrameMaker) -> None:
        self._maker = maker
        self._asking: Asking[str] = Asking(timeout_s=ANSWER_WITHIN_S, tries=TRIES)
        self._values: dict[str, float] = {}

    def ask_all(self) -> None:
        """From the beginning."""
        self._asking.ask(NAMES)

    def due(self, now: float, *, vehicle_system_id: int) -> bytes | None:
        """A request to send now."""
        while self._asking.current in GROUND_STATION_NAMES and self._ground_station_known():
            self._asking.answered()
        question = self._asking.due(now)
        if question is None:
            return None
        return self._maker.make(read_parameter(vehicle_system_id, question[0]), agent_sender(vehicle_system_id))

    def value(self, message: Any) -> None:
        """A PARAM_VALUE of the autopilot, whoever asked for it: somebody may have just set it."""
        name = str(message.param_id)
        if name in NAMES and isfinite(message.param_value):
            self._values[name] = message.param_value
            if name == self._asking.current:
                self._asking.answered()

    def _ground_station_known(self) -> bool:
        return any(name in self._values for name in GROUND_STATION_NAMES)

    @property
    def ground_station_system_id(self) -> int:
        """The sysid whose sticks the autopilot obeys."""
        for name in GROUND_STATION_NAMES:
            value = int(self._values.get(name, 0))
            if 0 < value <= 255:
                return value
        return _STANDARD_GROUND_STATION

    @property
    def channel_middles_us(self) -> tuple[int, int, int, int]:
        """Pulse widths of channels 1 to 4 (roll, pitch, throttle, yaw) with the sticks in the middle."""
        known = self._values.get
        throttle = (known("RC3_MIN", _MIDDLE_US) + known("RC3_MAX", _MIDDLE_US)) / 2
        if not ("RC3_MIN" in self._values and "RC3_MAX" in self._values):
            throttle = _MIDDLE_US
        return (
            int(known("RC1_TRIM", _MIDDLE_US)),
            int(known("RC2_TRIM", _MIDDLE_US)),
            int(throttle),
            int(known("RC4_TRIM", _MIDDLE_US)),
        )
