"""Which zones an agent is told: those near its drone that refuse, now or soon. A controller on board stays out of them.
Part of the hub: plain calls.

A message goes out after the welcome, on each change, and when the drone is MOVED_M from where the last one was about.
"""

from collections.abc import Iterable, Sequence
from datetime import datetime, timedelta
from math import inf
from typing import Final, NamedTuple

import msgspec

from server.airspace.core.zones.check import spot_of
from server.link.core.agent_link import AgentLink
from server.live.live_drone import LiveDrone
from server.live.live_state import LiveState
from wire.controllers import MAX_FOR_S
from wire.ids import LinkId
from wire.zones.area import Box
from wire.zones.index import NO_ZONES, ZoneIndex
from wire.zones.nearby import MAX_BYTES, MAX_ZONES, RADIUS_M, ZONES, NearbyZone, NearbyZones
from wire.zones.track import Spot, Track
from wire.zones.zone import Zone

MOVED_M: Final = 1_000.0
AHEAD_S: Final = MAX_FOR_S
"""A zone that begins later is told later: no controller flies longer."""


MAX_AT_ONCE: Final = 4
"""Agents that are told in one go. A hundred of them, among 500 zones, kept every frame waiting for half a second
(`python -m bench worst`)."""


class _Sent(NamedTuple):
    link: AgentLink
    channel: object
    zones: ZoneIndex
    about: Spot | None


class ZonesOnBoard:
    """One for the hub."""

    def __init__(self, state: LiveState) -> None:
        self._state = state
        self._sent: dict[int, _Sent] = {}
        self._soon: tuple[Zone, ...] = ()
        self._of_teams: dict[int | None, ZoneIndex] = {}
        self._waiting: dict[LinkId, AgentLink] = {}
        """Whose turn it is to be looked at, in order."""

    def renew(self, zones: Iterable[Zone]) -> None:
        """Every agent may have to be told. `zones`: all of the tower. Call it once a second, and after each change."""
        at = self._state.clock()
        soon = tuple(one for one in zones if one.binds and _counts_soon(one, at))
        if soon != self._soon:
            self._soon = soon
            self._of_teams = {team_id: _kept(index, soon, team_id) for team_id, index in self._of_teams.items()}
        links = self._state.links
        self._sent = {number: sent for number, sent in self._sent.items() if sent.link.link_id in links}
        self._waiting |= {link.link_id: link for link in links.values() if ZONES in link.takes}

    def tell(self) -> None:
        """Sends to at most MAX_AT_ONCE agents what they have not been told yet. Call it ten times a second."""
        told = 0
        while self._waiting and told < MAX_AT_ONCE:
            link = self._waiting.pop(next(iter(self._waiting)))
            drone = self._state.drones.get(link.drone_id)
            if drone is not None and drone.link is link:
                told += self._tell(drone, link)

    def _tell(self, drone: LiveDrone, link: AgentLink) -> bool:
        """Whether there was anything to tell."""
        team_id = drone.record.team.id if drone.record.team is not None else None
        zones = self._of_teams.get(team_id)
        if zones is None:
            zones = self._of_teams[team_id] = _kept(NO_ZONES, self._soon, team_id)
        here = spot_of(drone) if zones else None
        if zones and here is None:
            return False
        sent = self._sent.get(drone.drone_id)
        if (
            sent is not None
            and (sent.link, sent.channel) == (link, link.channel)
            and sent.zones is zones
            and not _is_far(sent.about, here)
        ):
            return False
        self._sent[drone.drone_id] = _Sent(link, link.channel, zones, here)
        link.post(NearbyZones() if here is None else nearby(zones, here, self._state.clock()))
        return True


def _kept(index: ZoneIndex, zones: Sequence[Zone], team_id: int | None) -> ZoneIndex:
    """The zones that count for drones of a team: the same index where nothing has changed for them."""
    count = tuple(one for one in zones if one.team_id is None or one.team_id == team_id)
    return index if index.zones == count else ZoneIndex(count)


def _counts_soon(zone: Zone, at: datetime) -> bool:
    begins_late = zone.valid_from is not None and zone.valid_from > at + timedelta(seconds=AHEAD_S)
    return not begins_late and (zone.valid_until is None or zone.valid_until > at)


def _is_far(about: Spot | None, here: Spot | None) -> bool:
    return about is not None and here is not None and Track(about, here).length_m >= MOVED_M


def nearby(zones: ZoneIndex, here: Spot, at: datetime) -> NearbyZones:
    """Returns the message about the zones within RADIUS_M of a place, the nearest first; within less where they are
    too many. Of each group of corridors the nearest is among them, wherever it is."""
    box = Box(here.lat_deg, here.lon_deg, here.lat_deg, here.lon_deg).widened(RADIUS_M)
    ranked = sorted(((_away_m(one, here), one) for one in zones.near(box)), key=lambda pair: pair[0])
    groups: set[int | None] = set()
    first, rest = [], []
    for away_m, zone in ranked:
        if zone.is_corridor and zone.team_id not in groups:
            groups.add(zone.team_id)
            first.append((away_m, zone))
        elif away_m <= RADIUS_M:
            rest.append((away_m, zone))
    told: list[NearbyZone] = []
    room, radius_m = MAX_BYTES, RADIUS_M
    for away_m, zone in [*first, *rest]:
        one = _as_told(zone, at)
        room -= len(msgspec.json.encode(one))
        if room < 0 or len(told) == MAX_ZONES:
            radius_m = max(min(away_m, RADIUS_M), 1.0)
            break
        told.append(one)
    lat_e7, lon_e7 = round(here.lat_deg * 1e7), round(here.lon_deg * 1e7)
    return NearbyZones(lat_e7=lat_e7, lon_e7=lon_e7, radius_m=radius_m, zones=tuple(told))


def _away_m(zone: Zone, here: Spot) -> float:
    """Over ground; for an area, something above RADIUS_M if it is further."""
    if zone.area.contains(here.lat_deg, here.lon_deg):
        return 0.0
    return zone.area.edge_m(here.lat_deg, here.lon_deg, inf if zone.is_corridor else RADIUS_M)


def _as_told(zone: Zone, at: datetime) -> NearbyZone:
    begins = None if zone.valid_from is None else max(0.0, (zone.valid_from - at).total_seconds())
    ends = None if zone.valid_until is None else max(0.0, (zone.valid_until - at).total_seconds())
    return NearbyZone(
        id=zone.id,
        name=zone.name,
        kind=zone.kind,
        points_e7=tuple((round(lat * 1e7), round(lon * 1e7)) for lat, lon in zone.shape.points),
        width_m=zone.shape.width_m,
        group=zone.team_id or 0,
        floor_m=zone.floor_m,
        ceiling_m=zone.ceiling_m,
        height_above=zone.height_above,
        reason=zone.reason,
        begins_in_s=begins,
        ends_in_s=ends,
    )
