"""Who is warned of an approach, and with which details: the separation of owners holds."""

from dataclasses import replace
from math import cos, radians
from typing import Any

import msgspec
import pytest
from hub_world import FakeAgent, FakeBrowser, HubWorld, record

from server.airspace.core.separation.motion import METRES_PER_DEGREE
from server.kernel.people import UserRef
from server.link.core.event_queue import EventQueue
from server.live import live_messages as live
from server.live.hub_events import HubEvent, SeparationLost
from wire.control_messages import AutopilotState
from wire.dialect import build, mavlink
from wire.ids import DroneId, UserId


def position(north_m: float, east_m: float, up_m: float, *, north_m_s: float = 0.0, east_m_s: float = 0.0) -> bytes:
    lat_e7 = round((47.0 + north_m / METRES_PER_DEGREE) * 1e7)
    lon_e7 = round((8.0 + east_m / METRES_PER_DEGREE / cos(radians(47.0))) * 1e7)
    up_mm, speed = round(up_m * 1000), (round(north_m_s * 100), round(east_m_s * 100), 0)
    message = mavlink.MAVLink_global_position_int_message(0, lat_e7, lon_e7, 400_000 + up_mm, up_mm, *speed, 0)
    return build(message, system_id=1, component_id=1, sequence=0)


def armed_heartbeat() -> bytes:
    message = mavlink.MAVLink_heartbeat_message(2, 3, 81 | mavlink.MAV_MODE_FLAG_SAFETY_ARMED, 5, 4, 3)
    return build(message, system_id=1, component_id=1, sequence=0)


KNOWN_S = 12.5
"""Time after which others may be told of a drone."""


class NearWorld(HubWorld):
    """alice's drone 1 and bob's drone 2 in the air, 6 m apart, bob's 3 m higher; every drone is sysid 1."""

    def __init__(self) -> None:
        super().__init__()
        self.noticed: list[HubEvent] = []
        self.hub.state.on_event = self.noticed.append
        self.now = 0.0
        self.places = {1: (0.0, 0.0, 50.0), 2: (0.0, 6.0, 53.0)}
        self.agents: dict[int, FakeAgent] = {}
        for drone_id in self.places:
            self.take_off(drone_id)

    def take_off(self, drone_id: int) -> None:
        agent = self.agents[drone_id] = self.agent(drone_id)
        self.report_state(drone_id, airborne=True)
        agent.received()

    def report_state(self, drone_id: int, *, airborne: bool) -> None:
        self.hub.reports.receive(
            self.agents[drone_id].link, AutopilotState(heard=True, armed=airborne, airborne=airborne)
        )

    def fly(self, for_s: float) -> None:
        for _ in range(round(for_s / 0.1)):
            self.now += 0.1
            for drone_id, agent in self.agents.items():
                agent.send(armed_heartbeat(), position(*self.places[drone_id]), now=self.now)
            self.hub.tick(self.now)


def heard(browser: FakeBrowser) -> list[live.Separation]:
    return [event for event in browser.events() if isinstance(event, live.Separation)]


def as_json(event: live.Separation) -> dict[str, Any]:
    reported: dict[str, Any] = msgspec.json.decode(live.encode_event(event))
    return reported


def test_who_may_see_one_of_two_is_told_where_the_other_is_and_not_which() -> None:
    world = NearWorld()
    alice, bob, admin = world.browser(1), world.browser(2), world.browser(9)
    world.fly(KNOWN_S)
    first = {name: heard(browser)[-1] for name, browser in (("alice", alice), ("bob", bob), ("admin", admin))}
    assert first["admin"].drones == (1, 2)
    assert first["alice"].drones == (1, None)
    assert first["bob"].drones == (2, None)
    assert len({event.number for event in first.values()}) == 3  # they must not reveal their relation
    assert as_json(first["alice"]) == {
        "type": "separation",
        "number": first["alice"].number,
        "level": "warning",
        "drones": [1, None],
        "in_s": 0,
        "horizontal_m": None,
        "vertical_m": None,
        "bearing_deg": 90,
        "distance_m": 10,
        "above_m": 5,
        "why": "",
    }
    assert (first["bob"].bearing_deg, first["bob"].distance_m, first["bob"].above_m) == (270, 10, -5)
    assert as_json(first["admin"]) == {
        "type": "separation",
        "number": first["admin"].number,
        "level": "warning",
        "drones": [1, 2],
        "in_s": 0.0,
        "horizontal_m": 6.0,
        "vertical_m": 3.0,
        "bearing_deg": 90,
        "distance_m": 6.0,
        "above_m": 3.0,
        "why": "",
    }


def test_a_stranger_hears_nothing() -> None:
    world = NearWorld()
    world.apply(record(1, (1,)), record(2, (1,)))
    bob = world.browser(2)
    world.fly(4)
    assert heard(bob) == []


def test_from_whom_the_view_was_taken_hears_nothing_of_where_their_drone_is() -> None:
    world = NearWorld()
    drone = world.hub.state.drones.get(DroneId(1))
    assert drone is not None
    drone.lease = replace(drone.lease, taken_from=UserRef(UserId(1), "alice"), view_taken=True)
    alice, bob = world.browser(1), world.browser(2)
    world.fly(KNOWN_S)
    assert heard(alice) == []
    assert heard(bob)[-1].drones == (2, None)


def test_whoever_comes_later_is_told_what_holds() -> None:
    world = NearWorld()
    world.fly(KNOWN_S)
    late = FakeBrowser(world.hub, 1)
    welcome, *others = late.events()
    assert isinstance(welcome, live.WelcomeBrowser)
    reported = [event for event in others if isinstance(event, live.Separation)]
    assert [event.level for event in reported] == ["warning"]


def test_figures_are_told_again_while_it_lasts_and_the_end_is_told_once() -> None:
    world = NearWorld()
    admin = world.browser(9)
    world.fly(3)
    heard(admin)
    world.places[2] = (0.0, 6.4, 53.0)
    world.fly(4)
    again = heard(admin)
    assert 1 <= len(again) <= 3
    assert again[-1].level == "warning" and again[-1].distance_m == 6.4
    world.report_state(2, airborne=False)
    world.fly(8)
    (end,) = heard(admin)
    assert (end.level, end.why, end.in_s, end.distance_m) == ("clear", "landed", None, None)


def test_an_autopilot_that_is_silent_has_not_landed() -> None:
    world = NearWorld()
    admin = world.browser(9)
    world.fly(3)
    assert heard(admin)
    silent = AutopilotState(heard=False, armed=False, airborne=False)
    world.hub.reports.receive(world.agents[2].link, silent)
    world.fly(4)
    assert "clear" not in [one.level for one in heard(admin)]


def test_a_link_that_breaks_is_no_landing() -> None:
    world = NearWorld()
    admin = world.browser(9)
    world.fly(3)
    agent = world.agents.pop(2)
    world.hub.detach_link(agent.link)
    world.fly(10)
    assert {event.level for event in heard(admin)} == {"warning"}
    world.fly(5)
    assert [(event.level, event.why) for event in heard(admin)] == [("clear", "unheard")]


def test_a_drone_that_is_removed_is_no_riddle() -> None:
    world = NearWorld()
    alice = world.browser(1)
    world.fly(KNOWN_S)
    assert heard(alice)
    del world.agents[2]
    world.apply(record(1, (1,)))
    world.fly(2)
    assert [(event.level, event.drones) for event in heard(alice)] == [("clear", (1, None))]


def test_a_warning_is_told_to_whoever_writes_it_down_and_counted() -> None:
    world = NearWorld()
    world.fly(3)
    (lost,) = [event for event in world.noticed if isinstance(event, SeparationLost)]
    assert (lost.drone_id, lost.other_id, lost.vertical_m) == (1, 2, 3.0)
    assert lost.horizontal_m == pytest.approx(6, abs=0.01)
    assert world.hub.state.traffic.separation == {"warning": 1}
    assert world.hub.separation.counts() == (0, 1, 0)


def test_a_slow_browser_keeps_one_word_for_each_pair() -> None:
    queue = EventQueue()

    def event(number: int, level: str) -> live.Separation:
        return live.Separation(number, level, (1, 2), None, None, None, None, None, None, "")  # type: ignore[arg-type]

    for reported in (event(1, "caution"), event(2, "caution"), event(1, "warning")):
        queue.put(reported)
    assert queue.take() == [event(1, "warning"), event(2, "caution")]
