"""The stream of sticks and switches to a flight controller. Pure; takes `now`.

A controller whose receiver is MSP obeys the last channels for some tenths of a second, and then its own failsafe acts.
So the stream is never kept up by itself: it ends STICKS_LAST_S after the last sticks that the agent let pass. The one
exceptions: a return that was commanded needs its switch until the drone is disarmed, and a switch that arms or disarms
goes out for PRESS_S with the throttle at the bottom.

Switches that nobody commanded keep the positions that the controller reports. Before it has reported any, nothing is
sent: a wrong switch would disarm it in the air.
"""

from __future__ import annotations

from collections.abc import Mapping
from struct import pack
from typing import Any, Final

from onboard_agent.autopilot.msp.answers import MAX_CHANNELS

EVERY_S: Final = 0.02
STICKS_LAST_S: Final = 0.5
PRESS_S: Final = 1.0
MAX_RETURN_S: Final = 900.0
"""A return that takes longer is none."""
CENTRE_US: Final = 1500
NOT_VALID: Final = 32767
_LEAVE: Final = (0, 0xFFFF)
_STICKS: Final = 4
USUAL_MAP: Final = (0, 1, 3, 2)
"""Where roll, pitch, yaw and throttle go (AETR), if the controller does not say."""


class StickStream:
    """Give it MANUAL_CONTROL, RC_CHANNELS_OVERRIDE and switches; send what `due` returns by MSP_SET_RAW_RC."""

    def __init__(self) -> None:
        self.order: tuple[int, ...] = USUAL_MAP
        """MSP_RX_MAP: the raw channel of roll, pitch, yaw, throttle."""
        self._sticks = [CENTRE_US, CENTRE_US, CENTRE_US, 1000]
        """Roll, pitch, yaw, throttle."""
        self._switches: dict[int, int] = {}
        self._sticks_at = float("-inf")
        self._returns_until = self._pressed_until = float("-inf")
        self._next_at = float("-inf")

    def manual_control(self, message: Any, now: float) -> None:
        """MAVLink's axes are -1000 to 1000, the throttle 0 to 1000. Without a throttle it says nothing."""
        if message.z == NOT_VALID:
            return
        axes = [
            CENTRE_US if axis == NOT_VALID else _pulse(CENTRE_US + axis / 2)
            for axis in (message.y, message.x, message.r)
        ]
        self._sticks = [*axes, _pulse(1000 + message.z)]
        self._sticks_at = now

    def override(self, message: Any, now: float) -> None:
        """RC_CHANNELS_OVERRIDE: roll, pitch, throttle, yaw, switches."""
        said = [getattr(message, f"chan{number}_raw") for number in range(1, MAX_CHANNELS + 1)]
        roll, pitch, throttle, yaw, *rest = said
        for index, value in enumerate((roll, pitch, yaw, throttle)):
            if value not in _LEAVE:
                self._sticks[index] = _pulse(value)
        self._switches |= {number: _pulse(value) for number, value in enumerate(rest) if value not in (*_LEAVE, 65534)}
        if any(value not in _LEAVE for value in said[:_STICKS]):
            self._sticks_at = now

    def switch(self, pulses: Mapping[int, int]) -> None:
        """Moves switches, by auxiliary channel. They stay there."""
        self._switches |= pulses

    def press(self, pulses: Mapping[int, int], now: float) -> None:
        """Moves the switch that arms or disarms, whether or not a person's sticks flow."""
        self.switch(pulses)
        self._pressed_until = now + PRESS_S

    def return_begun(self, now: float) -> None:
        """The switch of a return was moved: it needs the stream, with or without a person's sticks."""
        self._returns_until = now + MAX_RETURN_S

    def return_over(self) -> None:
        """Another mode was commanded, or the drone is disarmed."""
        self._returns_until = float("-inf")

    def goes(self, now: float) -> bool:
        """Whether the stream runs."""
        return now - self._sticks_at < STICKS_LAST_S or now < max(self._returns_until, self._pressed_until)

    def due(self, now: float, reported: tuple[int, ...]) -> bytes | None:
        """Returns the payload of MSP_SET_RAW_RC that is due now. `reported`: MSP_RC."""
        if now < self._next_at or not self.goes(now) or len(reported) <= _STICKS:
            return None
        self._next_at = now + EVERY_S
        sticks = self._sticks
        if now - self._sticks_at >= STICKS_LAST_S:
            sticks = [CENTRE_US, CENTRE_US, CENTRE_US, 1000 if now < self._pressed_until else CENTRE_US]
        raw = [CENTRE_US] * _STICKS
        for value, place in zip(sticks, self.order, strict=True):
            raw[place] = value
        rest = [self._switches.get(number, _pulse(value)) for number, value in enumerate(reported[_STICKS:])]
        return pack(f"<{_STICKS + len(rest)}H", *raw, *rest)


def _pulse(value: float) -> int:
    return max(900, min(round(value), 2100))
