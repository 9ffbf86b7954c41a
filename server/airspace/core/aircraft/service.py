"""Aircraft around the drones: takes what receivers heard, tells people, and finds what comes near. Part of the hub.

The path of a frame only puts frames of a few message ids into a bounded queue. They are read here, between other work.
"""

from functools import cache
from math import floor
from typing import Final

from server.airspace.core.aircraft import decode
from server.airspace.core.aircraft.decode import Identity, Report, Threat
from server.airspace.core.aircraft.messages import AircraftHeard, AircraftView
from server.airspace.core.aircraft.near import NOTHING, STALE_S, is_own, judge_along, near
from server.airspace.core.aircraft.shared import SharedAircraft, report_of, shared
from server.airspace.core.aircraft.table import Aircraft, AircraftTable, Heard, Trusts, Witness
from server.airspace.core.separation.motion import Motion, motion_in
from server.live.live_drone import LiveDrone
from server.live.live_state import LiveState
from server.towers.core.place import Place
from wire.ids import DroneId

READ_A_TICK: Final = 100
LOOK_S: Final = 1.0
PARTS: Final = 5
"""A fifth of the drones at each look."""
CELL_DEG: Final = 0.5
"""Of the feed only what is in the cell of a drone or beside it counts: some 50 km."""
MAX_TOLD: Final = 100
"""Aircraft in one message. The newest."""


class AircraftService:
    """One for the hub."""

    def __init__(self, state: LiveState) -> None:
        self._state = state
        self.table = AircraftTable(state.shares)
        self._pending = state.aircraft_frames
        self._told: set[int] = set()
        """Browsers whose map shows aircraft."""
        self._looked_at = float("-inf")
        self._part = 0

    def feed(self, reports: list[Report], now: float) -> None:
        """What the network feed has now: of it only what is near a drone."""
        near_drones = {cell for place in self._motions().values() for cell in _around(place)}
        for report in reports:
            if _cell(report.motion) in near_drones:
                self.table.take(report, None, now)

    def shared(self, now: float) -> list[SharedAircraft]:
        """For the other towers: what receivers of the drones here have heard."""
        here = (drone_id for drone_id, drone in self._state.drones.items() if drone.place is Place.HERE)
        return shared(self.table, here, now) if len(self.table) else []

    def heard_elsewhere(self, aircraft: list[SharedAircraft], now: float, *, late_s: float) -> None:
        """What receivers of drones at another tower have heard. `late_s`: how long the message was under way."""
        for one in aircraft:
            report = report_of(one, now - one.age_ms / 1000 - late_s)
            for number in one.heard_by if report is not None else ():
                drone = self._state.drones.get(DroneId(number))
                if report is not None and drone is not None and drone.place is not Place.HERE:
                    self.table.take(report, drone.drone_id, now)

    def tick(self, now: float) -> None:
        """Some ten times a second."""
        for _ in range(min(READ_A_TICK, len(self._pending))):
            drone_id, (frame, at) = self._pending.pop()
            try:
                self._take(drone_id, frame, at)
            except Exception as error:
                self._state.on_fault("aircraft", drone_id, error)
        if now - self._looked_at < LOOK_S / PARTS:
            return
        self._looked_at = now
        self._part = (self._part + 1) % PARTS
        if not len(self.table) and not self._told:
            return
        if self._part == 0:
            self.table.forget_old(now)
            motions = self._motions()
            for one in self.table:
                judge_along(one, motions, now)
            self._tell(now)
        self._look(now)

    def _take(self, drone_id: DroneId, frame: bytes, at: float) -> None:
        match decode.read(frame, at):
            case Report() as report:
                self.table.take(report, drone_id, at)
            case Identity() as identity:
                self.table.name(identity, drone_id)
            case Threat() as threat:
                self.table.threaten(threat, drone_id, at)
            case None:
                pass

    def _look(self, now: float) -> None:
        for drone_id, drone in self._state.drones.items():
            if drone_id % PARTS != self._part:
                continue
            flies = drone.counts_as_flying() and drone.place is Place.HERE
            own = motion_in(drone.position_frame, drone.position_at) if flies and drone.position_frame else None
            drone.aircraft_near = (
                NOTHING if own is None else near(drone_id, own, self.table, self._trusted_by(drone), now)
            )

    def _trusted_by(self, drone: LiveDrone) -> Trusts:
        """Whose receivers count for a drone: its own, and those of drones that its owners or its team may see."""
        ties = drone.record.ties
        people = ties.owners | ties.crew.keys()

        def trusts(other_id: DroneId) -> bool:
            other = self._state.drones.get(other_id)
            if other is None:
                return False
            theirs = other.record.ties
            return other is drone or not people.isdisjoint(theirs.owners | theirs.borrowers | theirs.crew.keys())

        return cache(trusts)

    def _motions(self) -> dict[DroneId, Motion]:
        found = {one: motion for one, motion in self._state.elsewhere.motions() if one in self._state.drones}
        for drone_id, drone in self._state.drones.items():
            if drone.place is not Place.HERE and drone_id in found:
                continue
            motion = motion_in(drone.position_frame, drone.position_at) if drone.position_frame is not None else None
            if motion is not None:
                found[drone_id] = motion
        return found

    def _tell(self, now: float) -> None:
        """To each browser what drones that it watches have heard, and the feed. Those of other towers hear it there."""
        shown: dict[int, list[tuple[Aircraft, Heard]]] = {}
        beside: dict[tuple[int, int], set[int]] = {}
        for drone_id, place in self._motions().items():
            watching = self._told_of(self._state.drones[drone_id])
            for cell in _around(place):
                beside.setdefault(cell, set()).update(watching)
        told_of: dict[DroneId, set[int]] = {}
        for one in self.table:
            for number, heard in self._heard_by_browser(one, beside, told_of, now).items():
                shown.setdefault(number, []).append((one, heard))
        for number in self._told - shown.keys():
            if number in self._state.browsers:
                self._state.browsers[number].notify(AircraftHeard([]))
        events: dict[tuple[tuple[str, Witness], ...], AircraftHeard] = {}
        for number, aircraft in shown.items():
            newest = sorted(aircraft, key=lambda pair: -pair[1].report.motion.at)[:MAX_TOLD]
            keys = tuple((one.key, heard.by) for one, heard in newest)
            event = events.get(keys)
            if event is None:
                event = events[keys] = AircraftHeard([_view(one, heard, now) for one, heard in newest])
            self._state.browsers[number].notify(event)
        self._told = set(shown)

    def _heard_by_browser(
        self, one: Aircraft, beside: dict[tuple[int, int], set[int]], told_of: dict[DroneId, set[int]], now: float
    ) -> dict[int, Heard]:
        """The newest report of an aircraft that each browser may know, but for its own drones. `told_of`: the browsers
        that watch a drone, filled here."""

        def watching(drone_id: DroneId) -> set[int]:
            if drone_id not in told_of:
                drone = self._state.drones.get(drone_id)
                told_of[drone_id] = set() if drone is None else self._told_of(drone)
            return told_of[drone_id]

        best: dict[int, Heard] = {}
        for by, report in one.reports.items():
            if by is not None:
                numbers = watching(by)
            elif now - report.motion.at <= STALE_S:
                # Only beside one's own drones: where the feed is cut off would show where those of others are.
                numbers = beside.get(_cell(report.motion), set())
            else:
                continue
            for number in numbers:
                if number not in best or best[number].report.motion.at < report.motion.at:
                    best[number] = Heard(by, report)
        return {
            number: heard
            for number, heard in best.items()
            if not is_own(one, heard, lambda drone_id, number=number: number in watching(drone_id), now)  # type: ignore[misc]
        }

    def _told_of(self, drone: LiveDrone) -> set[int]:
        return {browser.number for browser in self._state.frame_watchers_of(drone) if not browser.is_visitor}


def _cell(place: Motion) -> tuple[int, int]:
    return floor(place.lat_deg / CELL_DEG), floor(place.lon_deg / CELL_DEG)


def _around(place: Motion) -> list[tuple[int, int]]:
    row, column = _cell(place)
    return [(row + up, column + along) for up in (-1, 0, 1) for along in (-1, 0, 1)]


def _view(one: Aircraft, heard: Heard, now: float) -> AircraftView:
    report, motion = heard.report, heard.report.motion
    return AircraftView(
        key=one.key,
        manned=report.kind is decode.Kind.MANNED,
        name=one.label_of(heard),
        lat=round(motion.lat_deg, 6),
        lon=round(motion.lon_deg, 6),
        alt_amsl_m=round(motion.alt_amsl_m, 1) if report.has_height else None,
        course_deg=report.course_deg,
        speed_m_s=None if report.speed_m_s is None else round(report.speed_m_s, 1),
        climb_m_s=round(motion.up_m_s, 1),
        squawk=report.squawk,
        on_ground=report.on_ground,
        age_s=round(max(0.0, now - motion.at), 1),
    )
