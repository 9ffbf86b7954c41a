"""What a drone's autopilot did last, once the tower no longer hears it: for pages that open after the loss. No I/O."""

from dataclasses import dataclass
from datetime import datetime
from typing import Final

from server.control.core.loan_limits import whole_place_in
from server.fleet.core.views import LastHeardView
from wire.control_messages import AutopilotState
from wire.frames import payload

_TYPE: Final = 4
_AUTOPILOT: Final = 5
"""Offsets in a HEARTBEAT. Its last byte is never zero, so its payload is complete."""


@dataclass
class LastHeard:
    """For one drone, as long as the tower knows it. Empty while it is heard, and before its first report."""

    view: LastHeardView | None = None
    _reported: AutopilotState | None = None
    """The newest report of an autopilot that the agent heard."""

    @property
    def ever(self) -> bool:
        """Whether its agent has reported an autopilot since the tower started."""
        return self._reported is not None

    def reported(self, state: AutopilotState) -> None:
        """The agent reports. Of a silent autopilot it reports nothing else."""
        if state.heard:
            self._reported, self.view = state, None

    def heard_again(self) -> None:
        """The same link continues, with an autopilot that is heard."""
        self.view = None

    def silent(self, at: datetime, heartbeat: bytes | None, position: bytes | None) -> None:
        """Link or autopilot are not heard from this time on. `heartbeat`, `position`: the newest, as they came."""
        state = self._reported
        if self.view is not None or state is None:
            return
        heart = None if heartbeat is None else payload(heartbeat)
        place = None if position is None else whole_place_in(position)
        self.view = LastHeardView(
            at=at,
            armed=state.armed,
            airborne=state.airborne,
            vehicle_type=None if heart is None else heart[_TYPE],
            autopilot=None if heart is None else heart[_AUTOPILOT],
            custom_mode=None if heart is None else int.from_bytes(heart[:4], "little"),
            lat=None if place is None else place.lat_deg,
            lon=None if place is None else place.lon_deg,
            height_m=None if place is None else place.alt_rel_m,
        )
