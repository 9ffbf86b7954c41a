"""Reads the autopilot parameters that the failsafe and the preflight check need, one by one. No I/O.

ArduPilot accepts sticks only from the sysid configured as its ground station. The middle of its throttle channel is
halfway between the ends, not at the trim. The other parameters decide what the autopilot does on a loss. The agent
reads them and never writes them.
"""

from collections.abc import Mapping
from math import isfinite
from struct import Struct
from typing import Final

from onboard_agent.autopilot.asking import Asking
from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, read_parameter
from wire.autopilots.registry import FAMILIES
from wire.frames import payload

ANSWER_WITHIN_S: Final = 1.0
TRIES: Final = 3

GROUND_STATION_NAMES: Final = tuple(name for family in FAMILIES.values() for name in family.station_parameters)

LOSS_NAMES: Final = {autopilot: family.loss_parameters for autopilot, family in FAMILIES.items()}
"""By autopilot, the parameters that decide what happens on a loss, and that identify a simulated autopilot."""

DECIDING: Final = {autopilot: family.deciding_parameters for autopilot, family in FAMILIES.items()}
"""The subset that every autopilot has and that determines its behaviour. A few requests may be lost on the way, even
three times."""

ASK_AGAIN_AFTER_S: Final = 30.0
MAX_REPEATED: Final = 20
"""Ten minutes. It ends because a plane, for example, has other names for them."""

NAMES: Final = {
    autopilot: tuple(dict.fromkeys((*family.station_parameters, *family.stick_parameters, *family.loss_parameters)))
    for autopilot, family in FAMILIES.items()
}
"""All parameters that are read, in this order: those needed for flying first."""

_PARAM_VALUE: Final = Struct("<4sHH16sB")
INTEGERS: Final = {
    1: Struct("<B"),
    2: Struct("<b"),
    3: Struct("<H"),
    4: Struct("<h"),
    5: Struct("<I"),
    6: Struct("<i"),
}
"""By MAV_PARAM_TYPE."""
_FLOAT: Final = Struct("<f")

_MIDDLE_US: Final = 1500
_STANDARD_GROUND_STATION: Final = 255


def read_value(frame: bytes, autopilot_kind: int) -> tuple[str, float] | None:
    """Returns (name, value) of a whole PARAM_VALUE frame, or None if the value is not a finite number.

    PX4 puts the bytes of an integer into the float field; ArduPilot sends every value as a float.
    """
    raw, _, _, name, kind = _PARAM_VALUE.unpack_from(payload(frame).ljust(_PARAM_VALUE.size, b"\0"))
    family = FAMILIES.get(autopilot_kind)
    layout = INTEGERS.get(kind, _FLOAT) if family is not None and family.bytes_in_parameters else _FLOAT
    (value,) = layout.unpack_from(raw)
    if not isfinite(value):
        return None
    return name.split(b"\0", 1)[0].decode("ascii", "replace"), float(value)


class Parameters:
    """Call `ask_all` when an autopilot appears, `due` at each tick, `value` for each PARAM_VALUE."""

    def __init__(self, maker: FrameMaker) -> None:
        self._maker = maker
        self._asking: Asking[str] = Asking(timeout_s=ANSWER_WITHIN_S, tries=TRIES)
        self._kind = 0
        self._values: dict[str, float] = {}
        self._ask_again_at: float | None = None
        self._asked_again = 0
        self._assumed_ground_station = _STANDARD_GROUND_STATION

    def assume_ground_station(self, system_id: int) -> None:
        """Uses the value that the previous process has read, until it is read again."""
        self._assumed_ground_station = system_id

    def ask_all(self, autopilot_kind: int) -> None:
        """Reads all from the beginning. Values of an autopilot of the same kind remain valid until read again."""
        if autopilot_kind != self._kind:
            self._values.clear()
        self._kind = autopilot_kind
        self._asking.ask(NAMES.get(autopilot_kind, ()))
        self._ask_again_at = None
        self._asked_again = 0

    def due(self, now: float, *, vehicle_system_id: int) -> bytes | None:
        """Returns a request to send now, or None."""
        while self._asking.current in GROUND_STATION_NAMES and self._ground_station_known():
            self._asking.answered()
        if self._asking.current is None and not self.complete and self._kind in NAMES:
            self._ask_missing_again(now)
        question = self._asking.due(now)
        if question is None:
            return None
        return self._maker.make(read_parameter(vehicle_system_id, question[0]), agent_sender(vehicle_system_id))

    def _ask_missing_again(self, now: float) -> None:
        if self._ask_again_at is None:
            self._ask_again_at = now + ASK_AGAIN_AFTER_S
        elif now >= self._ask_again_at and self._asked_again < MAX_REPEATED:
            self._ask_again_at = None
            self._asked_again += 1
            self._asking.ask(name for name in NAMES[self._kind] if name not in self._values)

    def value(self, frame: bytes) -> None:
        """Handles any PARAM_VALUE of the autopilot, requested or not, because another party may just have set it."""
        read = read_value(frame, self._kind)
        if read is not None and read[0] in NAMES.get(self._kind, ()):
            self._values[read[0]] = read[1]
            if read[0] == self._asking.current:
                self._asking.answered()

    def _ground_station_known(self) -> bool:
        return any(name in self._values for name in GROUND_STATION_NAMES)

    @property
    def all_read(self) -> bool:
        """Whether every parameter has been answered or given up at least once."""
        return self._asking.current is None or self._asked_again > 0

    @property
    def complete(self) -> bool:
        """Whether the DECIDING parameters and the sysid of the ground station have been read."""
        if any(name not in self._values for name in DECIDING.get(self._kind, ("",))):
            return False
        family = FAMILIES.get(self._kind)
        return family is None or not family.station_parameters or self._ground_station_known()

    @property
    def loss_values(self) -> dict[str, float]:
        """The known parameters that decide what happens on a loss."""
        return {name: self._values[name] for name in LOSS_NAMES.get(self._kind, ()) if name in self._values}

    @property
    def values(self) -> Mapping[str, float]:
        """All known values, by name."""
        return self._values

    @property
    def overrides_last_s(self) -> float:
        """How long the autopilot obeys the last sticks from the agent; infinite if it never drops them."""
        value = self._values.get("RC_OVERRIDE_TIME", 3.0)
        return value if value >= 0 else float("inf")

    @property
    def ground_station_system_id(self) -> int:
        """The sysid whose sticks the autopilot obeys."""
        for name in GROUND_STATION_NAMES:
            value = int(self._values.get(name, 0))
            if 0 < value <= 255:
                return value
        return self._assumed_ground_station

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
