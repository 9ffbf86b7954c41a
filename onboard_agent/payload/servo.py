"""A servo on a PWM pin of the companion computer: its setting, its pulses, and what to write for them. Pure.

Linux has the pins below /sys/class/pwm (Documentation/driver-api/pwm.rst): a chip's channel is exported, and then has
the files `period`, `duty_cycle` and `enable`, in nanoseconds. The kernel refuses a period shorter than the duty cycle
and an enabled channel without a period, so the order of the writes matters.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final
from urllib.parse import parse_qsl

from onboard_agent.unusable import Unusable

NS_PER_US: Final = 1000
MIN_PULSE_US: Final = 400
MAX_PULSE_US: Final = 2600
"""No servo takes more; a longer pulse is a mistake in a setting or a command."""
MIN_PERIOD_US: Final = 3000
"""Fast digital servos take 333 Hz."""
MAX_PERIOD_US: Final = 50_000
FORM: Final = "NUMBER=pwmchipC/N[?min=1000&max=2000&range=90&period=20000]"
_FORM: Final = re.compile(r"(\d{1,3})=pwmchip(\d{1,3})/(\d{1,3})(?:\?(.+))?")

Write = tuple[str, bytes]
"""A file below /sys/class/pwm, and all of what is written to it."""


@dataclass(frozen=True)
class Servo:
    """`number`: the one in MAV_CMD_DO_SET_SERVO. `low_us`, `high_us`: its shortest and longest pulse. `range_deg`: how
    far it turns between them."""

    number: int
    chip: int
    channel: int
    low_us: int = 1000
    high_us: int = 2000
    range_deg: float = 90.0
    period_us: int = 20_000

    @property
    def _folder(self) -> str:
        return f"pwmchip{self.chip}/pwm{self.channel}"

    def pulse_of(self, angle_deg: float) -> float:
        """Returns the pulse for an angle from the middle, in microseconds. Raises ValueError beyond its range."""
        half = self.range_deg / 2
        if not -half <= angle_deg <= half:
            raise ValueError(f"servo {self.number} turns {half:g} degrees to each side")
        return (self.low_us + self.high_us) / 2 + angle_deg / self.range_deg * (self.high_us - self.low_us)

    def takes(self, pulse_us: float) -> bool:
        """Returns whether the pulse is within its range. False for NaN."""
        return self.low_us <= pulse_us <= self.high_us

    def export(self) -> Write:
        """The channel's files appear behind this. The kernel answers EBUSY if they are there already."""
        return f"pwmchip{self.chip}/export", b"%d" % self.channel

    def no_pulse(self) -> Write:
        """A duty cycle of nothing. The kernel answers EINVAL before there is a period."""
        return f"{self._folder}/duty_cycle", b"0"

    def period(self) -> Write:
        """Sets the period. The kernel answers EINVAL while an earlier duty cycle is longer."""
        return f"{self._folder}/period", b"%d" % (self.period_us * NS_PER_US)

    def move(self, pulse_us: float) -> Sequence[Write]:
        """Moves it. Raises ValueError beyond its range."""
        if not self.takes(pulse_us):
            raise ValueError(f"servo {self.number} takes {self.low_us} to {self.high_us} microseconds")
        duty = b"%d" % round(pulse_us * NS_PER_US)
        return (f"{self._folder}/duty_cycle", duty), (f"{self._folder}/enable", b"1")

    def end(self) -> Sequence[Write]:
        """Stops the pulses and gives the pin back."""
        return (f"{self._folder}/enable", b"0"), (f"pwmchip{self.chip}/unexport", b"%d" % self.channel)


def parse_servos(texts: Sequence[str]) -> tuple[Servo, ...]:
    """Parses the setting; an element may hold several, separated by commas. Raises Unusable."""
    servos = tuple(_servo(one) for text in texts for one in text.split(",") if one.strip())
    if len({one.number for one in servos}) < len(servos) or len({(o.chip, o.channel) for o in servos}) < len(servos):
        raise Unusable("servos: a number or a pin is named twice")
    return servos


def _servo(text: str) -> Servo:
    found = _FORM.fullmatch(text.strip())
    if found is None:
        raise Unusable(f"servos: {text!r} must have the form {FORM}")
    number, chip, channel, options = found.groups()
    said = dict(parse_qsl(options or "", keep_blank_values=True))
    try:
        servo = Servo(
            int(number),
            int(chip),
            int(channel),
            low_us=int(said.pop("min", "1000")),
            high_us=int(said.pop("max", "2000")),
            range_deg=float(said.pop("range", "90")),
            period_us=int(said.pop("period", "20000")),
        )
    except ValueError:
        raise Unusable(f"servos: {text!r}: min, max, range and period are numbers") from None
    if said:
        raise Unusable(f"servos: {text!r}: there is no option {next(iter(said))!r}")
    if not MIN_PULSE_US <= servo.low_us < servo.high_us <= MAX_PULSE_US:
        raise Unusable(f"servos: {text!r}: pulses have {MIN_PULSE_US} to {MAX_PULSE_US} microseconds")
    if not MIN_PERIOD_US <= servo.period_us <= MAX_PERIOD_US or not 0 < servo.range_deg <= 360:
        raise Unusable(f"servos: {text!r}: a period has {MIN_PERIOD_US} to {MAX_PERIOD_US} microseconds, a range 360")
    return servo
