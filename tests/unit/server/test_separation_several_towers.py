"""Drones at different towers that come near each other: each tower's own hub, and a bus without a network."""

from collections import deque
from dataclasses import replace
from typing import Any

import msgspec
import pytest
from hub_world import FakeAgent, FakeBrowser, HubWorld, heartbeat, record
from test_separation_notifier import KNOWN_S, armed_heartbeat, position

from server.airspace.core.separation.elsewhere import KEEP_S
from server.airspace.core.separation.encounter import UNHEARD_S
from server.alerts.core.rules import TOO_NEAR
from server.kernel.people import UserRef
from server.live.hub_events import HubEvent, SeparationLost
from server.live.live_messages import AlertChanged, Relayed, Separation, encode_event
from server.towers.core.messages import EventUp
from server.towers.core.place import Place
from server.towers.core.towers import Towers
from server.towers.core.visitors import Stop, Visitor
from wire.control_messages import AutopilotState
from wire.dialect import build, mavlink
from wire.ids import DroneId, UserId

A, B = "a" * 32, "b" * 32


class OneTower:
    """A hub among others. `bus`: packets on their way, (receiver, packet)."""

    def __init__(self, me: str, bus: deque[tuple[str, bytes]]) -> None:
        self.world = HubWorld()
        self.hub = self.world.hub
        self.noticed: list[HubEvent] = []
        self.hub.state.on_event = self.noticed.append
        self.visitors: list[Visitor] = []
        self.towers = Towers(
            me,
            self.hub,
            publish=lambda tower, packet: bus.append((tower, packet)),
            begin_writing=self._begin,
        )
        for drone_id in self.hub.state.drones:
            self.hub.place_drone(drone_id, Place.NOWHERE, 0.0)

    def _begin(self, visitor: Visitor) -> Stop:
        self.visitors.append(visitor)
        return lambda: self.visitors.remove(visitor)

    def tick(self, now: float) -> None:
        self.hub.tick(now)
        for one in self.visitors:
            for event in one.take_events():
                self.towers.send(one.tower, EventUp(one.remote, encode_event(event).encode()))
        self.towers.tick(now)
        self.towers.flush(now)

    def open_alerts(self) -> list[tuple[str, int, int | None, bool]]:
        """Rule, drone, the other, about a stranger."""
        alerts = (one for one in self.hub.alerts.live() if one.other_id is not None and one.closed_at is None)
        return sorted((one.rule.name, int(one.drone_id), one.other_id, one.about_stranger) for one in alerts)


class TwoTowers:
    """alice's drone 1 is at home at `a`, bob's drone 2 at `b`: in the air, 6 m apart, the second 3 m higher."""

    def __init__(self, *, versions: tuple[int, int] = (2, 2)) -> None:
        self.now = 0.0
        self.bus: deque[tuple[str, bytes]] = deque()
        self.towers = {A: OneTower(A, self.bus), B: OneTower(B, self.bus)}
        self.a, self.b = self.towers[A], self.towers[B]
        self.cut = False
        for one in (self.a, self.b):
            one.towers.set_members((A, B), 0.0)
            one.towers.set_versions(dict(zip((A, B), versions, strict=True)))
        self.agents: dict[int, FakeAgent] = {}
        self.places = {1: (0.0, 0.0, 50.0), 2: (0.0, 6.0, 53.0)}
        self.silent: set[int] = set()
        self.pass_time(2.0)
        self.bring(1, self.a, claim=1)
        self.bring(2, self.b, claim=1)
        self.pass_time(0.5)

    def bring(self, drone_id: int, tower: OneTower, *, claim: int) -> None:
        """The drone's agent links there, in the air."""
        self.agents[drone_id] = tower.world.agent(drone_id, link_id=100 * claim + drone_id)
        tower.towers.claimed([(drone_id, claim)], self.now)
        self.report(drone_id, tower, airborne=True)

    def report(self, drone_id: int, tower: OneTower, *, airborne: bool) -> None:
        state = AutopilotState(heard=True, armed=airborne, airborne=airborne)
        tower.hub.reports.receive(self.agents[drone_id].link, state)

    def pass_time(self, for_s: float) -> None:
        for _ in range(round(for_s / 0.1)):
            self.now += 0.1
            for drone_id, agent in self.agents.items():
                if drone_id not in self.silent:
                    agent.send(heartbeat(), armed_heartbeat(), position(*self.places[drone_id]), now=self.now)
            for one in self.towers.values():
                one.tick(self.now)
            while self.bus:
                tower, packet = self.bus.popleft()
                if not self.cut:
                    self.towers[tower].towers.receive(packet, self.now)

    def place(self, tower: OneTower, drone_id: int) -> Place:
        return tower.hub.state.drones[DroneId(drone_id)].place


def heard(browser: FakeBrowser, kind: str) -> list[dict[str, Any]]:
    """Events of this kind, from this tower or another one."""
    found = []
    for event in browser.events():
        if isinstance(event, (Relayed, Separation, AlertChanged)):
            told: dict[str, Any] = msgspec.json.decode(encode_event(event))
            if told["type"] == kind:
                found.append(told)
    return found


@pytest.fixture
def two() -> TwoTowers:
    return TwoTowers()


def test_each_pair_has_one_alert_and_who_sees_both_is_told_once(two: TwoTowers) -> None:
    assert (two.place(two.a, 2), two.place(two.b, 1)) == (Place.ELSEWHERE, Place.ELSEWHERE)
    at_a, at_b = two.a.world.browser(9), two.b.world.browser(9)
    two.pass_time(KNOWN_S)
    assert two.a.open_alerts() == [(TOO_NEAR.name, 1, 2, False), (TOO_NEAR.name, 1, 2, True)]
    assert two.b.open_alerts() == [(TOO_NEAR.name, 2, 1, True)], "the home of the lower number leads"
    for browser in (at_a, at_b):
        events = [one for one in heard(browser, "separation") if one["drones"] == [1, 2]]
        assert len({one["number"] for one in events}) == 1
        assert (events[-1]["level"], events[-1]["distance_m"], events[-1]["above_m"]) == ("warning", 6.0, 3.0)
    noticed = [one for tower in (two.a, two.b) for one in tower.noticed if isinstance(one, SeparationLost)]
    assert len(noticed) == 1, "one row in the audit trail"
    assert (two.a.hub.separation.counts().warnings, two.b.hub.separation.counts().warnings) == (1, 0)


def test_who_sees_one_of_them_is_told_of_a_stranger_wherever_they_are_connected(two: TwoTowers) -> None:
    alice, bob = two.b.world.browser(1), two.a.world.browser(2)
    two.pass_time(KNOWN_S)
    for browser, own, bearing in ((alice, 1, 90), (bob, 2, 270)):
        (last, *_) = reversed(heard(browser, "separation"))
        assert (last["drones"], last["bearing_deg"], last["distance_m"]) == ([own, None], bearing, 10)
        assert last["horizontal_m"] is None


def test_the_alert_ends_when_one_lands_at_its_tower(two: TwoTowers) -> None:
    admin = two.a.world.browser(9)
    two.pass_time(KNOWN_S)
    heard(admin, "separation")
    two.report(2, two.b, airborne=False)
    two.pass_time(1.5)
    (last, *_) = reversed([one for one in heard(admin, "separation") if one["drones"] == [1, 2]])
    assert (last["level"], last["why"]) == ("clear", "landed")
    assert (two.a.open_alerts(), two.b.open_alerts()) == ([], [])


def test_positions_of_a_tower_that_is_not_heard_grow_old_and_are_dropped(two: TwoTowers) -> None:
    two.pass_time(KNOWN_S)
    two.cut = True
    two.pass_time(UNHEARD_S)
    assert len(two.a.hub.state.elsewhere) == 1
    assert two.a.open_alerts(), "silence does not mean that it went away"
    two.pass_time(KEEP_S)
    assert (two.a.open_alerts(), two.b.open_alerts()) == ([], [])
    assert len(two.a.hub.state.elsewhere) == 0
    two.cut = False
    two.pass_time(KNOWN_S + 3.0)
    assert two.a.open_alerts() == [(TOO_NEAR.name, 1, 2, False), (TOO_NEAR.name, 1, 2, True)]


def test_a_stale_position_raises_nothing(two: TwoTowers) -> None:
    two.places[2] = (0.0, 5_000.0, 53.0)
    two.pass_time(KNOWN_S)
    two.silent.add(2)
    two.pass_time(4.0)
    two.places[1] = (0.0, 4_998.0, 53.0)
    two.pass_time(5.0)
    assert (two.a.open_alerts(), two.b.open_alerts()) == ([], [])


def test_a_pair_goes_on_at_one_tower_when_one_of_them_moves_there(two: TwoTowers) -> None:
    admin = two.a.world.browser(9)
    two.pass_time(KNOWN_S)
    first = {one["number"] for one in heard(admin, "separation")}
    two.bring(1, two.b, claim=2)
    two.pass_time(KNOWN_S)
    assert two.place(two.a, 1) is Place.ELSEWHERE
    assert two.a.open_alerts() == [], "none of them is at home here"
    assert (TOO_NEAR.name, 1, 2, False) in two.b.open_alerts()
    events = heard(admin, "separation")
    assert {one["number"] for one in events if one["level"] == "clear"} >= first, "the former alert has ended"
    assert [one["level"] for one in events if one["drones"] == [1, 2]][-1] == "warning"


def test_from_whom_the_view_was_taken_hears_nothing_from_another_tower(two: TwoTowers) -> None:
    """The home alone knows of it at once."""
    for tower in (two.a, two.b):
        tower.world.apply(record(1, (1,)), record(2, (1, 2)))
    drone = two.b.hub.state.drones[DroneId(2)]
    drone.lease = replace(drone.lease, taken_from=UserRef(UserId(1), "alice"), view_taken=True)
    two.pass_time(1.0)
    alice = two.a.world.browser(1)
    two.pass_time(KNOWN_S)
    assert {tuple(one["drones"]) for one in heard(alice, "separation")} == {(1, None)}


def test_a_tower_of_the_version_before_is_told_nothing_that_it_does_not_know() -> None:
    older = TwoTowers(versions=(2, 1))
    older.pass_time(1.0)
    assert (len(older.a.hub.state.elsewhere), len(older.b.hub.state.elsewhere)) == (1, 0)
    assert older.b.towers.packets_dropped == 0


def test_what_one_drone_hears_warns_a_drone_of_the_same_people_at_another_tower(two: TwoTowers) -> None:
    for tower in (two.a, two.b):
        tower.world.apply(record(1, (1,)), record(2, (1, 2)))
    two.places[2] = (0.0, 3_000.0, 53.0)
    alice, bob = two.b.world.browser(1), two.b.world.browser(2)
    two.pass_time(2.0)
    lat_e7, lon_e7 = 470_000_000, round((8.0 + 0.0394) * 1e7)  # beside drone 2
    aircraft = mavlink.MAVLink_adsb_vehicle_message(
        0x4B1234, lat_e7, lon_e7, 0, 450_000, 9_000, 3_000, 0, b"HELI1", 7, 0, 31, 0
    )
    two.agents[1].send(build(aircraft, system_id=1, component_id=1, sequence=0), now=two.now)
    two.pass_time(3.0)
    assert "HELI1" in two.b.hub.state.drones[DroneId(2)].aircraft_near.manned
    told = [event for event in alice.events() if type(event).__name__ == "AircraftHeard"]
    assert told and told[-1].aircraft[0].name == "HELI1", "her drone at the other tower heard it"
    assert [event for event in bob.events() if type(event).__name__ == "AircraftHeard"] == [], "his has not"


def test_the_remote_id_of_a_drone_of_another_tower_is_no_foreign_drone(two: TwoTowers) -> None:
    two.places[2] = (0.0, 40.0, 53.0)
    two.pass_time(2.0)
    lat_e7, lon_e7 = 470_000_000, round((8.0 + 40.0 / 75_919.0) * 1e7)
    located = mavlink.MAVLink_open_drone_id_location_message(
        0, 0, b"\1" * 20, 2, 36_000, 0, 0, lat_e7, lon_e7, 453.0, 453.0, 0, 53.0, 10, 5, 5, 2, 100.0, 2
    )
    for _ in range(5):
        two.agents[1].send(build(located, system_id=1, component_id=1, sequence=0), now=two.now)
        two.pass_time(1.0)
    assert len(two.a.hub.aircraft.table) == 1
    assert two.a.hub.state.drones[DroneId(1)].aircraft_near.unmanned == ""
