"""The radio receiver on board, and the stick positions while the transmitter is untouched."""

from __future__ import annotations

from enum import StrEnum

CHANNELS = 18
RECEIVER_CHANNELS = 8
"""The number of channels of a receiver."""

_SWITCHES = (1800, 1000, 1000, 1800)
"""Channels 5 to 8: the mode switch is in its last position."""


class Receiver(StrEnum):
    """`tower-sim --radio NAME`."""

    LOW = "low"
    """The throttle rests at its bottom, as on a transmitter whose throttle has no spring."""
    CENTRED = "centred"
    NONE = "none"

    @property
    def is_fitted(self) -> bool:
        return self is not Receiver.NONE

    @property
    def at_rest(self) -> list[int]:
        """Returns the PWM of all channels; 0 if nothing is received."""
        if not self.is_fitted:
            return [0] * CHANNELS
        throttle = 1000 if self is Receiver.LOW else 1500
        sent = (1500, 1500, throttle, 1500, *_SWITCHES)
        return [*sent, *([0] * (CHANNELS - RECEIVER_CHANNELS))]
