"""Whether the drone has a radio receiver that hears a transmitter. No I/O.

Sticks that we send look to the autopilot like a receiver, so nothing is learned while it goes by them.
"""

from typing import Any, Final

from wire.dialect import mavlink

LAPSE_S: Final = 2.0
"""After our sticks have lapsed: until then the autopilot may not have said so yet."""

_RECEIVER: Final = mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
_NO_VALUES: Final = (0, 65535)


class Radio:
    """Tell it of our sticks; feed it SYS_STATUS and RC_CHANNELS; read `has_radio`."""

    def __init__(self) -> None:
        self.has_radio: bool | None = None
        self._sticks_at: float | None = None
        self._health_tells = False

    def sticks_sent(self, now: float) -> None:
        """Sticks, the holder's or our own, went to the autopilot."""
        self._sticks_at = now

    def sys_status(self, message: Any, now: float, *, overrides_last_s: float) -> None:
        """SYS_STATUS of the autopilot: the better source, where it knows the receiver at all."""
        if not message.onboard_control_sensors_present & _RECEIVER:
            return
        self._health_tells = True
        if not self._overridden(now, overrides_last_s):
            self.has_radio = bool(message.onboard_control_sensors_health & _RECEIVER)

    def rc_channels(self, message: Any, now: float, *, overrides_last_s: float) -> None:
        """RC_CHANNELS of the autopilot."""
        if self._health_tells or self._overridden(now, overrides_last_s):
            return
        sticks = (message.chan1_raw, message.chan2_raw, message.chan3_raw, message.chan4_raw)
        self.has_radio = message.chancount > 0 and any(value not in _NO_VALUES for value in sticks)

    def _overridden(self, now: float, overrides_last_s: float) -> bool:
        return self._sticks_at is not None and now - self._sticks_at < overrides_last_s + LAPSE_S
