"""ArduCopter's stick positions: from the receiver on board, RC_CHANNELS_OVERRIDE or MANUAL_CONTROL.

Rules (AUTOPILOTS.md): only the sysid of the configured ground station may move sticks; others are silently ignored.
Each overridden channel expires separately and returns to the receiver's value. Values change only when input arrives,
from a transmitter or from the ground station; without either they stay unchanged. For the radio failsafe, a receiver
counts while it has a signal, a ground station only when its sticks arrive: without a receiver the failsafe sets in
while the last sticks are still in force.
"""

from __future__ import annotations

import bisect
from collections.abc import Sequence
from dataclasses import dataclass

from simulator.geodesy import clamp
from simulator.parameters import Parameters
from simulator.receiver import CHANNELS, RECEIVER_CHANNELS, Receiver

IGNORE = 65535
RELEASE_HIGH = 65534
"""Releases channels 9 to 18; on channels 1 to 8, 0 does."""
AXIS_INVALID = 32767

PWM_VALID = range(900, 2201)
SWITCH_EDGES = (1230, 1360, 1490, 1620, 1749)
"""Of the six positions of the mode switch."""


@dataclass(frozen=True, slots=True)
class _Axis:
    """The channel of an axis, and its calibration: RCMAP_*, RCn_*."""

    index: int
    low: float
    high: float
    trim: float
    zone: float
    sign: float

    @classmethod
    def of(cls, parameters: Parameters, name: str) -> _Axis:
        channel = min(max(parameters.whole(f"RCMAP_{name}"), 1), 16)
        low, high, trim, zone, is_reversed = (
            parameters[f"RC{channel}_{what}"] for what in ("MIN", "MAX", "TRIM", "DZ", "REVERSED")
        )
        return cls(channel - 1, low, high, trim, zone, -1.0 if is_reversed else 1.0)


class Sticks:
    def __init__(self, parameters: Parameters, receiver: Receiver) -> None:
        self._parameters = parameters
        self.receiver = receiver
        self.radio_pwm = receiver.at_rest
        self.pwm = list(self.radio_pwm)
        self.ever_heard = False
        self.last_input_s: float | None = None
        """Time of the last input from the receiver or a ground station's sticks."""
        self._receiver_ever_heard = False
        self._override: dict[int, tuple[int, float]] = {}
        self._override_came = False
        self._axes: dict[str, _Axis] = {}
        self._axes_version = -1

    def accepts(self, sender_sysid: int) -> bool:
        return sender_sysid == self._parameters.whole("SYSID_MYGCS")

    @property
    def overridden(self) -> bool:
        return bool(self._override)

    @property
    def channel_count(self) -> int:
        """The receiver's channels. Overridden channels do not count (measured)."""
        return RECEIVER_CHANNELS if self._receiver_ever_heard else 0

    def clear_overrides(self) -> None:
        self._override.clear()

    def override(self, channels: Sequence[int], now_s: float) -> None:
        """RC_CHANNELS_OVERRIDE from a sender that `accepts` admits; `channels` are the raw values of 1 to 18."""
        for index, value in enumerate(channels[:CHANNELS]):
            if value == IGNORE or (index >= 8 and value == 0):
                continue
            if value == (0 if index < 8 else RELEASE_HIGH):
                self._release(index)
            else:
                self._set(index, value, now_s)

    def manual_control(self, *, x: int, y: int, z: int, r: int, now_s: float) -> None:
        """MANUAL_CONTROL: x forward, y right, r clockwise -1000..1000; z throttle 0..1000 with 500 the middle.

        An invalid axis returns to the receiver; a negative throttle invalidates the whole message.
        """
        if z < 0:
            return
        for axis, value, low, high in (
            ("ROLL", y, -1000, 1000),
            ("PITCH", -x if x != AXIS_INVALID else x, -1000, 1000),
            ("THROTTLE", z, 0, 1000),
            ("YAW", r, -1000, 1000),
        ):
            flown = self._axis(axis)
            if value == AXIS_INVALID:
                self._release(flown.index)
                continue
            share = clamp((value - low) / (high - low), 0.0, 1.0)
            self._set(flown.index, round(flown.low + share * (flown.high - flown.low)), now_s)

    def _set(self, index: int, pwm: int, now_s: float) -> None:
        if self._parameters["RC_OVERRIDE_TIME"] == 0:
            return
        self._override[index] = (pwm, now_s)
        self._override_came = True

    def _release(self, index: int) -> None:
        self._override.pop(index, None)
        self._override_came = True

    def update(self, now_s: float, *, transmitter_lost: bool) -> None:
        """Expires overrides and updates the present value of each channel."""
        lasts_s = self._parameters["RC_OVERRIDE_TIME"]
        if self._override and lasts_s >= 0:
            for index in [i for i, (_, since) in self._override.items() if now_s - since >= lasts_s]:
                del self._override[index]
        receiver_heard = self.receiver.is_fitted and not transmitter_lost
        self._receiver_ever_heard |= receiver_heard
        came, self._override_came = self._override_came, False
        if not receiver_heard and not came:
            return
        self.ever_heard = True
        if self._receiver_ever_heard:
            self.pwm[:] = self.radio_pwm
        for index, (value, _) in self._override.items():
            self.pwm[index] = value
        if self._receiver_ever_heard or self._override:
            self.last_input_s = now_s

    def silent_for_s(self, now_s: float) -> float:
        return now_s - self.last_input_s if self.last_input_s is not None else now_s

    # The pilot's input, as the flight modes read it.

    @property
    def roll(self) -> float:
        """-1 left .. 1 right."""
        return self._centred("ROLL")

    @property
    def pitch(self) -> float:
        """-1 forward (nose down) .. 1 back."""
        return self._centred("PITCH")

    @property
    def yaw(self) -> float:
        return self._centred("YAW")

    @property
    def throttle(self) -> float:
        """0..1000; 0 is the bottom of the stick, dead zone included."""
        axis = self._axis("THROTTLE")
        pwm = self.pwm[axis.index]
        return _throttle(axis, pwm) if pwm in PWM_VALID else 0.0

    @property
    def throttle_mid(self) -> float:
        axis = self._axis("THROTTLE")
        return _throttle(axis, (axis.low + axis.high) / 2)

    @property
    def climb_mps(self) -> float:
        """The climb rate that the throttle stick requests in modes that hold height."""
        throttle, middle, zone = self.throttle, self.throttle_mid, self._parameters["THR_DZ"]
        up = self._parameters["PILOT_SPEED_UP"] / 100.0
        down = self._parameters["PILOT_SPEED_DN"] / 100.0 or up
        if throttle > middle + zone:
            return up * (throttle - middle - zone) / (1000.0 - middle - zone)
        if throttle < middle - zone:
            return -down * (middle - zone - throttle) / (middle - zone)
        return 0.0

    @property
    def mode_switch(self) -> int | None:
        """1..6, the position of the mode switch, or None without a valid signal."""
        channel = self._parameters.whole("FLTMODE_CH")
        pwm = self.pwm[channel - 1] if 1 <= channel <= CHANNELS else 0
        if pwm not in PWM_VALID:
            return None
        return 1 + bisect.bisect_left(SWITCH_EDGES, pwm)

    def _axis(self, name: str) -> _Axis:
        if self._parameters.version != self._axes_version:
            self._axes_version = self._parameters.version
            self._axes = {axis: _Axis.of(self._parameters, axis) for axis in ("ROLL", "PITCH", "THROTTLE", "YAW")}
        return self._axes[name]

    def _centred(self, name: str) -> float:
        axis = self._axis(name)
        pwm = self.pwm[axis.index]
        if pwm not in PWM_VALID:
            return 0.0
        if pwm > axis.trim + axis.zone:
            value = (pwm - axis.trim - axis.zone) / max(axis.high - axis.trim - axis.zone, 1.0)
        elif pwm < axis.trim - axis.zone:
            value = (pwm - axis.trim + axis.zone) / max(axis.trim - axis.zone - axis.low, 1.0)
        else:
            return 0.0
        return axis.sign * clamp(value, -1.0, 1.0)


def _throttle(axis: _Axis, pwm: float) -> float:
    low = axis.low + axis.zone
    return clamp(1000.0 * (pwm - low) / max(axis.high - low, 1.0), 0.0, 1000.0)
