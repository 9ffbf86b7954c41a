"""Where the drone is, from GLOBAL_POSITION_INT, relative to where the controller began, and its attitude. No I/O; takes
`now`."""

from math import degrees
from typing import Any, Final

from onboard_agent.autonomy.core.local_plane import LocalPlane
from onboard_agent.autonomy.core.safe_commands import Motion
from onboard_agent.transactions.handler import Around
from wire.autopilots.commands import VehicleState
from wire.places import place_of

_NO_HEADING: Final = 65535


class PositionTrack:
    """Feed it each GLOBAL_POSITION_INT and ATTITUDE of the autopilot."""

    def __init__(self) -> None:
        self.plane: LocalPlane | None = None
        """Of the first position."""
        self.motion: Motion | None = None
        self.home_alt_m = 0.0
        """Above sea level."""
        self.at = float("-inf")
        self._lat_deg = self._lon_deg = 0.0
        self._attitude = (0.0, 0.0, 0.0, 0.0)
        """Roll, pitch and yaw in degrees, and when they came."""

    @property
    def known(self) -> bool:
        """Whether a position came."""
        return self.motion is not None

    def receive(self, message: Any, now: float) -> None:
        """Takes ATTITUDE or GLOBAL_POSITION_INT. An autopilot without a position has none here."""
        if message.get_type() == "ATTITUDE":
            self._attitude = (degrees(message.roll), degrees(message.pitch), degrees(message.yaw), now)
            return
        place = place_of(message.lat, message.lon)
        if place is None:
            return
        self._lat_deg, self._lon_deg = place
        if self.plane is None:
            self.plane = LocalPlane(self._lat_deg, self._lon_deg)
        before = 0.0 if self.motion is None else self.motion.heading_deg
        self.motion = Motion(
            *self.plane.local(self._lat_deg, self._lon_deg),
            height_m=message.relative_alt / 1000,
            north_m_s=message.vx / 100,
            east_m_s=message.vy / 100,
            up_m_s=-message.vz / 100,
            heading_deg=before if message.hdg == _NO_HEADING else message.hdg / 100,
            at=now,
        )
        self.home_alt_m = (message.alt - message.relative_alt) / 1000
        self.at = now

    def told(self) -> tuple[float, float, float, float, float, float, float]:
        """Returns latitude, longitude, height, velocities and heading, as in `lines.Seen`."""
        one = self.motion
        assert one is not None
        speed = (one.north_m_s, one.east_m_s, one.up_m_s)
        return (self._lat_deg, self._lon_deg, one.height_m, *speed, one.heading_deg)

    def pose(self) -> tuple[float, float, float, float, float]:
        """Returns when the position came, the angles and when those came, as in `lines.Seen`."""
        return (self.at, *self._attitude)

    def vehicle_state(self, around: Around) -> VehicleState:
        """Returns the state for a command of the profile."""
        one = self.motion
        return VehicleState(
            "the drone",
            around.custom_mode,
            armed=around.armed,
            airborne=around.airborne,
            home_alt_m=None if one is None else self.home_alt_m,
            place_deg=None if one is None else (self._lat_deg, self._lon_deg),
            height_m=None if one is None else one.height_m,
            heading_deg=None if one is None else one.heading_deg,
        )
