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
            channel = self._channel(axis)
            if value == AXIS_INVALID:
                self._release(channel - 1)
                continue
            lowest, highest = self._range(channel)
            share = clamp((value - low) / (high - low), 0.0, 1.0)
            self._set(channel - 1, round(lowest + share * (highest - lowest)), now_s)

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
        channel = self._channel("THROTTLE")
        pwm = self.pwm[channel - 1]
        return self._throttle_of(channel, pwm) if pwm in PWM_VALID else 0.0

    @property
    def throttle_mid(self) -> float:
        channel = self._channel("THROTTLE")
        low, high = self._range(channel)
        return self._throttle_of(channel, (low + high) / 2)

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

    def _channel(self, axis: str) -> int:
        return min(max(self._parameters.whole(f"RCMAP_{axis}"), 1), 16)

    def _range(self, channel: int) -> tuple[float, float]:
        return self._parameters[f"RC{channel}_MIN"], self._parameters[f"RC{channel}_MAX"]

    def _throttle_of(self, channel: int, pwm: float) -> float:
        low, high = self._range(channel)
        low += self._parameters[f"RC{channel}_DZ"]
        return clamp(1000.0 * (pwm - low) / max(high - low, 1.0), 0.0, 1000.0)

    def _centred(self, axis: str) -> float:
        channel = self._channel(axis)
        pwm = self.pwm[channel - 1]
        if pwm not in PWM_VALID:
            return 0.0
        low, high = self._range(channel)
        trim, zone = self._parameters[f"RC{channel}_TRIM"], self._parameters[f"RC{channel}_DZ"]
        if pwm > trim + zone:
            value = (pwm - trim - zone) / max(high - trim - zone, 1.0)
        elif pwm < trim - zone:
            value = (pwm - trim + zone) / max(trim - zone - low, 1.0)
        else:
            return 0.0
        return clamp(value, -1.0, 1.0) * (-1.0 if self._parameters[f"RC{channel}_REVERSED"] else 1.0)
