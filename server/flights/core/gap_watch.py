"""Finds the stretches of a recorded flight in which nothing came over the link. Pure.

The recorder looks at each flight twice a second. A gap begins when the drone was heard last and ends when it is heard
again; a margin on both sides covers what was lost while the link failed, or was thinned out when it was back.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from wire.ids import DroneId

if TYPE_CHECKING:
    from server.live.live_drone import LiveDrone

GAP_S: Final = 1.5
"""A drone that flies is heard several times a second, and by a keep-alive each second at the least."""
MARGIN_US: Final = 5_000_000
MAX_GAPS: Final = 64
"""Of one flight. A link that breaks more often is not worth the bookkeeping: the log file of the drone has it all."""


@dataclass(frozen=True)
class GapFound:
    """By the clock of the flight's file, margins included. `sink`: what writes the flight."""

    drone_id: DroneId
    sink: object
    from_us: int
    to_us: int


@dataclass
class _Flight:
    heard_us: int
    offset_us: int
    gap_from_us: int | None = None
    gaps: int = 0


class GapWatch:
    """`on_gap`: told of each, once."""

    def __init__(self) -> None:
        self.on_gap: Callable[[GapFound], None] = lambda gap: None
        self._flights: dict[int, _Flight] = {}

    def look(self, drone: LiveDrone, sink: object, offset_us: int, now: float) -> None:
        """A flight that is being recorded."""
        now_us = int(now * 1e6) + offset_us
        heard_us = self._heard_us(drone, offset_us, now)
        flight = self._flights.get(id(sink))
        if flight is None:
            self._flights[id(sink)] = _Flight(heard_us or now_us, offset_us)
            return
        if heard_us is not None and now_us - heard_us <= GAP_S * 1e6:
            if flight.gap_from_us is not None:
                self._tell(drone, sink, flight, now_us)
            elif heard_us - flight.heard_us > (GAP_S + 1.0) * 1e6:  # over between two looks of a busy tower
                flight.gap_from_us = flight.heard_us
                self._tell(drone, sink, flight, now_us)
            flight.heard_us = heard_us
        elif flight.gap_from_us is None:
            flight.heard_us = max(flight.heard_us, heard_us or 0)
            if now_us - flight.heard_us > GAP_S * 1e6:
                flight.gap_from_us = flight.heard_us

    def over(self, drone: LiveDrone, sink: object, now: float) -> None:
        """The flight is over."""
        flight = self._flights.pop(id(sink), None)
        if flight is not None and flight.gap_from_us is not None:
            self._tell(drone, sink, flight, int(now * 1e6) + flight.offset_us)

    @staticmethod
    def _heard_us(drone: LiveDrone, offset_us: int, now: float) -> int | None:
        """When the drone was last heard by its present link; None: not by this one."""
        link = drone.link
        if link is None or link.routes.newest is None or not drone.online:
            return None
        return int((now - link.sealed.keepalive.silent_for(now)) * 1e6) + offset_us

    def _tell(self, drone: LiveDrone, sink: object, flight: _Flight, to_us: int) -> None:
        assert flight.gap_from_us is not None
        flight.gaps += 1
        if flight.gaps <= MAX_GAPS:
            self.on_gap(GapFound(drone.drone_id, sink, flight.gap_from_us - MARGIN_US, to_us + MARGIN_US))
        flight.gap_from_us = None
