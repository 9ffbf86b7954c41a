"""The zones of the tower: which ones count for which drone now, who sees them, and drones in flight near them.

Part of the hub: plain calls, no database, `now` passed in. The store hands over all zones after each change. It adds
nothing to the path of a frame but, for a command with a place, the judgement of that place: drones in flight are
checked by their newest position, at most CHECKS_PER_S times a second.
"""

from collections import Counter
from collections.abc import Collection, Iterable
from typing import Final

from server.airspace.core.separation.motion import motion_in
from server.airspace.core.zones.check import spot_of
from server.airspace.core.zones.messages import ZonesChanged
from server.airspace.core.zones.on_board import ZonesOnBoard
from server.airspace.core.zones.watch import hold_words
from server.kernel.access import Action, reaches_all
from server.kernel.people import Principal
from server.kernel.relations import Right
from server.live import live_messages as live
from server.live.hub_events import ZoneReached
from server.live.live_drone import MANUAL_FOR_S, LiveDrone
from server.live.live_state import LiveState
from server.towers.core.place import Place
from wire.autopilots import registry
from wire.autopilots.profile import FlightTask
from wire.frames import payload
from wire.zones.index import NO_ZONES, ZoneIndex
from wire.zones.zone import Zone

CHECKS_PER_S: Final = 5
RENEW_S: Final = 1.0
"""How often it is looked which zones count at this time of day, and for which teams."""
_TYPE, _AUTOPILOT, _HEARTBEAT = 4, 5, 9
_GOES_DOWN: Final = (FlightTask.RETURN, FlightTask.LANDING)


class ZoneService:
    """One for the hub."""

    def __init__(self, state: LiveState) -> None:
        self._state = state
        self._zones: dict[int, Zone] = {}
        self._indexes: dict[int | None, ZoneIndex] = {}
        """By team. That of the tower's own zones (None) is part of all others."""
        self._active: tuple[Zone, ...] = ()
        self._on_board = ZonesOnBoard(state)
        self._renewed_at = float("-inf")
        self.holds_ordered = 0

    @property
    def count(self) -> int:
        return len(self._zones)

    def count_by_team(self) -> Counter[int | None]:
        """How many zones each team has; None: the tower."""
        return Counter(zone.team_id for zone in self._zones.values())

    def replace(self, zones: Iterable[Zone]) -> None:
        """All zones, as the database has them. Tells those whose zones have changed."""
        before, self._zones = self._zones, {zone.id: zone for zone in zones}
        changed = [one for one in before.values() if self._zones.get(one.id) != one]
        changed += [one for one in self._zones.values() if before.get(one.id) != one]
        if not changed:
            return
        self._renew()
        self._on_board.renew(self._zones.values())
        self._on_board.tell()
        teams = {one.team_id for one in changed}
        for browser in self._state.browsers.values():
            if None in teams or teams & self._teams_of(browser.viewer):
                browser.notify(ZonesChanged())

    def visible(self, viewer: Principal, teams: Collection[int] = ()) -> list[Zone]:
        """The zones that this user may see: the tower's, and those of the teams of drones in their squad. `teams`:
        those that they are in."""
        if reaches_all(viewer.role, Action.LEAD_TEAMS):
            return list(self._zones.values())
        seen = self._teams_of(viewer) | set(teams)
        return [zone for zone in self._zones.values() if zone.team_id is None or zone.team_id in seen]

    def tick(self, now: float) -> None:
        """Some ten times a second."""
        if now - self._renewed_at >= RENEW_S:
            self._renewed_at = now
            if self._zones or self._indexes:
                self._renew()
            self._on_board.renew(self._zones.values())
        self._on_board.tell()
        if not self._indexes:
            return
        for drone_id, drone in self._state.drones.items():
            # No new position: what was last known stays. Silence does not mean that it left.
            due = drone.zone_watch.checked_at + 0.9 / CHECKS_PER_S
            if drone.zones and now >= due and drone.position_at > drone.zone_watch.checked_at:
                try:
                    self._check(drone, now)
                except Exception as error:
                    self._state.on_fault("zones", drone_id, error)

    def _renew(self) -> None:
        at = self._state.clock()
        active = tuple(zone for zone in self._zones.values() if zone.is_valid_at(at))
        if active != self._active:
            self._active = active
            self._indexes = {}
        if not active:
            self._indexes = {}
        for drone in self._state.drones.values():
            team_id = drone.record.team.id if drone.record.team is not None else None
            index = self._index(team_id) if active else NO_ZONES
            if drone.zones is not index:
                drone.zones = index
                if not index:
                    drone.zone_watch.reset()

    def _index(self, team_id: int | None) -> ZoneIndex:
        index = self._indexes.get(team_id)
        if index is None:
            count = [one for one in self._active if one.team_id == team_id]
            if team_id is None:
                index = ZoneIndex(count) if count else NO_ZONES
            else:
                index = ZoneIndex(count, beside=self._index(None)) if count else self._index(None)
            self._indexes[team_id] = index
        return index

    def _check(self, drone: LiveDrone, now: float) -> None:
        if drone.place is not Place.HERE:
            return  # its home watches over it
        drone.zone_watch.checked_at = now
        here = spot_of(drone)
        motion = motion_in(drone.position_frame, drone.position_at) if drone.position_frame is not None else None
        if here is None or motion is None or not drone.counts_as_flying():
            drone.zone_watch.reset()
            return
        steered = drone.flown_by_hand(now) or now - drone.zone_watch.setpoints_at < MANUAL_FOR_S
        by_hand = steered and not _goes_down(drone)
        zone = drone.zone_watch.check(drone.zones, here, motion, by_hand=by_hand)
        if zone is not None:
            why = hold_words(zone)
            self.holds_ordered += 1
            pilot = drone.watchers.get(drone.sticks_from)
            user_id = pilot.viewer.user_id if pilot is not None else drone.holder_id
            self._state.on_event(ZoneReached(drone.drone_id, user_id, zone.id, zone.name, why))
            text = f"{drone.record.name} holds: {why}."
            self._state.notify_watchers(drone, live.Notice("error", "zone", text, drone.drone_id, 1))

    def _teams_of(self, viewer: Principal) -> set[int | None]:
        """The teams of the drones that this user may see; for an admin, every team that has a zone."""
        if reaches_all(viewer.role, Action.LEAD_TEAMS):
            return {zone.team_id for zone in self._zones.values()} | {
                one.record.team.id for one in self._state.drones.values() if one.record.team is not None
            }
        return {
            drone.record.team.id
            for drone in self._state.drones.values()
            if drone.record.team is not None and drone.may(viewer.user_id, viewer.role, Right.SEE)
        }


def _goes_down(drone: LiveDrone) -> bool:
    """Returns or lands: no zone stops that, whatever the sticks do meanwhile."""
    if drone.heartbeat is None:
        return False
    heart = payload(drone.heartbeat).ljust(_HEARTBEAT, b"\0")
    mode = registry.nearest(heart[_AUTOPILOT], heart[_TYPE]).mode(int.from_bytes(heart[:4], "little"))
    return mode is not None and mode.task in _GOES_DOWN
