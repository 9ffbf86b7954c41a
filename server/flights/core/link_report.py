"""What a flight's index says of the link, and where the drone was then. Pure."""

from __future__ import annotations

from typing import Any, Final

from server.link.core.agent_link import AgentLink
from server.link.core.viewport import place_in
from server.live.live_drone import LiveDrone

MAX_AGE_S: Final = 5.0
"""A position older than this is not where the drone was."""
LAST_PLACE_AGE_S: Final = 30.0
"""A lost link is noticed late: its place is the last one known."""
_DIGITS: Final = 5
"""Of degrees: a metre."""


def link_report(drone: LiveDrone, link: AgentLink, now: float) -> dict[str, Any]:
    """The quality of the link, with `lat` and `lon` in degrees where the drone has a position."""
    quality = link.quality(now)
    about: dict[str, Any] = {"rtt_ms": quality.rtt_ms, "loss": quality.loss}
    about |= {"transport": quality.transport, "uplinks": quality.uplinks}
    return about | place_of(drone, now, MAX_AGE_S)


def place_of(drone: LiveDrone, now: float, max_age_s: float = LAST_PLACE_AGE_S) -> dict[str, float]:
    """Empty: the drone has no position, or only an old one."""
    if drone.position_frame is None or now - drone.position_at > max_age_s:
        return {}
    place = place_in(drone.position_frame)
    return {} if place is None else {"lat": round(place[0], _DIGITS), "lon": round(place[1], _DIGITS)}
