"""Whether the autopilot has just accepted a command that starts the motors. No I/O; takes `now`.

ArduPilot sends one heartbeat a second, so the last one may still say "disarmed" while the drone climbs.
"""

from typing import Any, Final

from wire.dialect import mavlink

COUNTS_FOR_S: Final = 2.0
"""How long an accepted command outweighs a heartbeat that says "disarmed"."""

_STARTS_MOTORS: Final = frozenset(
    {
        mavlink.MAV_CMD_COMPONENT_ARM_DISARM,
        mavlink.MAV_CMD_NAV_TAKEOFF,
        mavlink.MAV_CMD_MISSION_START,
    }
)
_ACCEPTED: Final = frozenset({mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_IN_PROGRESS})


class RecentStart:
    """Feed it each COMMAND_ACK, regardless of the addressee."""

    def __init__(self) -> None:
        self._at = float("-inf")

    def acknowledged(self, ack: Any, now: float) -> None:
        """A COMMAND_ACK of the autopilot."""
        if ack.command in _STARTS_MOTORS and ack.result in _ACCEPTED:
            self._at = now

    def counts_as_armed(self, now: float) -> bool:
        """Whether the drone counts as armed, regardless of the last heartbeat."""
        return now - self._at <= COUNTS_FOR_S
