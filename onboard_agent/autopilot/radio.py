"""Whether the drone has a radio receiver that receives a transmitter. No I/O.

The agent's sticks look to the autopilot like a receiver's, so channel values and receiver health prove nothing while
they are in force. Only the number of channels is always valid: 0 without a receiver (measured on ArduCopter,
docs/control.md). Whether a transmitter is still received cannot be known then: see `hidden`.
"""

from typing import Any, Final

from wire.dialect import mavlink

SILENT_S: Final = 6.0
"""RC_CHANNELS is requested at 2 Hz. PX4 sends none without a receiver."""

LAPSE_S: Final = 2.0
"""Wait after the agent's sticks have expired, because the autopilot may not have reported that earlier."""

SWITCHED_US: Final = 100
"""A switch moves a channel by more; noise does not."""

SWITCHED_S: Final = 3.0
"""A mode that a switch selects is shown within a second."""

_RECEIVER: Final = mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
_NO_VALUES: Final = (0, 65535)


class Radio:
    """Report sent sticks to it; feed it SYS_STATUS and RC_CHANNELS; read `has_radio`."""

    def __init__(self) -> None:
        self.has_radio: bool | None = None
        self._sticks_at: float | None = None
        self._health_has_receiver = False
        self._no_channels = False
        self._channels_at: float | None = None
        self._switches: tuple[int, ...] = ()
        self._switched_at = float("-inf")

    def hidden(self, now: float, *, overrides_last_s: float) -> bool:
        """Whether a receiver is on board, and sticks hide whether it still receives the transmitter."""
        return not self._no_channels and self._overridden(now, overrides_last_s)

    def switched(self, now: float) -> bool:
        """Whether a switch of the transmitter has just moved. The agent's sticks leave those channels alone."""
        return now - self._switched_at < SWITCHED_S

    def asked(self, now: float) -> None:
        """RC_CHANNELS was requested from an autopilot that has just appeared."""
        self._channels_at = now

    def check(self, now: float) -> None:
        """Advances time. For an autopilot that sends RC_CHANNELS only with a receiver.

        Its SYS_STATUS counts for nothing: any station's sticks look like a receiver there.
        """
        if self._channels_at is not None and now - self._channels_at >= SILENT_S:
            self.has_radio = False

    def sticks_sent(self, now: float) -> None:
        """Sticks from the holder or the agent went to the autopilot."""
        self._sticks_at = now

    def sys_status(self, message: Any, now: float, *, overrides_last_s: float) -> None:
        """Handles SYS_STATUS of the autopilot: the better source, if it reports on a receiver at all."""
        if not message.onboard_control_sensors_present & _RECEIVER:
            return
        self._health_has_receiver = True
        if not self._overridden(now, overrides_last_s) and not self._no_channels:
            self.has_radio = bool(message.onboard_control_sensors_health & _RECEIVER)

    def rc_channels(self, message: Any, now: float, *, overrides_last_s: float) -> None:
        """RC_CHANNELS of the autopilot."""
        self._channels_at = now
        self._no_channels = message.chancount == 0
        if self._no_channels:
            self.has_radio = False
            return
        switches = (message.chan5_raw, message.chan6_raw, message.chan7_raw, message.chan8_raw)
        if any(abs(new - old) > SWITCHED_US for new, old in zip(switches, self._switches, strict=False)):
            self._switched_at = now
        self._switches = switches
        if self._health_has_receiver or self._overridden(now, overrides_last_s):
            return
        sticks = (message.chan1_raw, message.chan2_raw, message.chan3_raw, message.chan4_raw)
        self.has_radio = any(value not in _NO_VALUES for value in sticks)

    def _overridden(self, now: float, overrides_last_s: float) -> bool:
        return self._sticks_at is not None and now - self._sticks_at < overrides_last_s + LAPSE_S
