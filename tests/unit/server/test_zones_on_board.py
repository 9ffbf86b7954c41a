"""Which zones an agent is told, and when: on its link, on each change, and when its drone has moved far."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from datetime import timedelta
from typing import Any

import pytest
from hub_world import NOW, HubWorld, record
from test_zones_geometry import at, spot, zone
from test_zones_of_drones import position

from server.airspace.core.zones.on_board import MAX_AT_ONCE, nearby
from server.kernel.fleet import TeamRecord
from wire.control_messages import MAX_MESSAGE_BYTES, decode_to_agent, encode_message
from wire.ids import DroneId
from wire.zones.index import ZoneIndex
from wire.zones.kinds import ZoneKind, ZoneRule
from wire.zones.nearby import RADIUS_M, ZONES, NearbyZones
from wire.zones.zone import Zone


def square(east_m: float, size_m: float = 50.0, **more: Any) -> Zone:
    corners = ((east_m, 0), (east_m + size_m, 0), (east_m + size_m, size_m), (east_m, size_m))
    return zone(points=tuple(at(*one) for one in corners), **more)


class Drone:
    """A drone over home, and its agent."""

    def __init__(self, takes: Collection[str] = (ZONES,)) -> None:
        self.world = HubWorld()
        self.world.apply(record(1, (1,)))
        self.hub = self.world.hub
        self.agent = self.world.agent(1, takes=takes)
        self.now = 0.0
        self.be(0.0)

    def be(self, east_m: float) -> None:
        self.now += 2.0
        self.agent.send(position(east_m, 20.0), now=self.now)
        self.hub.tick(self.now)

    def told(self) -> list[NearbyZones]:
        """Since the last call."""
        told = [one for one in self.agent.posted if isinstance(one, NearbyZones)]
        self.agent.posted.clear()
        return told


def names(message: NearbyZones) -> list[str]:
    return [one.name for one in message.zones]


def test_a_change_is_told_at_once_and_only_once() -> None:
    drone = Drone()
    assert drone.told() == [NearbyZones()], "nothing may be left of another tower's zones"
    drone.be(0.0)
    assert not drone.told()
    airport = square(200, reason="jets", floor_m=10.0)
    drone.hub.zones.replace([airport])
    (message,) = drone.told()
    assert message == decode_to_agent(encode_message(message))
    (one,) = message.zones
    assert (one.name, one.reason, one.floor_m, one.begins_in_s) == ("Airport", "jets", 10.0, None)
    assert one.points_e7[0] == tuple(round(part * 1e7) for part in airport.shape.points[0])
    assert message.radius_m == RADIUS_M
    drone.be(5.0)
    drone.hub.zones.replace([airport])
    assert not drone.told()
    drone.hub.zones.replace([replace(airport, ceiling_m=90.0)])
    assert drone.told()[0].zones[0].ceiling_m == 90.0
    drone.hub.zones.replace([])
    assert drone.told() == [NearbyZones()]


def test_an_older_agent_is_told_nothing() -> None:
    drone = Drone(takes=())
    drone.hub.zones.replace([square(200)])
    drone.be(0.0)
    assert not drone.told()


def test_a_new_link_and_a_new_control_channel_are_told_again() -> None:
    drone = Drone()
    drone.hub.zones.replace([square(200)])
    drone.told()
    drone.agent.link.channel = object()
    drone.be(0.0)
    assert [names(one) for one in drone.told()] == [["Airport"]]
    drone.agent = drone.world.agent(1, link_id=300, takes=(ZONES,))
    drone.be(0.0)
    assert [names(one) for one in drone.told()] == [["Airport"]]


def test_only_zones_that_refuse_and_count_for_the_drone_are_told() -> None:
    drone = Drone()
    theirs, ours = (TeamRecord(one, f"Team {one}", {}, NOW) for one in (5, 6))
    drone.hub.state.drones[DroneId(1)].record = replace(drone.hub.state.drones[DroneId(1)].record, team=ours)
    in_a_minute, in_an_hour = NOW + timedelta(seconds=60), NOW + timedelta(hours=1)
    drone.hub.zones.replace(
        [
            square(200, id=1, name="tower"),
            square(300, id=2, name="ours", team_id=ours.id),
            square(300, id=3, name="theirs", team_id=theirs.id),
            square(300, id=4, name="warns", rule=ZoneRule.WARN),
            square(300, id=5, name="over", valid_until=NOW - timedelta(seconds=1)),
            square(300, id=6, name="tomorrow", valid_from=NOW + timedelta(days=1)),
            square(300, id=7, name="soon", valid_from=in_a_minute, valid_until=in_an_hour),
        ]
    )
    message = drone.told()[-1]
    assert names(message) == ["tower", "ours", "soon"]
    assert [(one.begins_in_s, one.ends_in_s) for one in message.zones] == [(None, None), (None, None), (60.0, 3600.0)]
    assert [one.group for one in message.zones] == [0, ours.id, 0]


def test_a_drone_that_has_moved_far_is_told_what_is_near_now() -> None:
    drone = Drone()
    drone.hub.zones.replace([square(200, id=1, name="near"), square(5_600, id=2, name="far")])
    assert names(drone.told()[-1]) == ["near"]
    drone.be(900.0)
    assert not drone.told()
    drone.be(1_100.0)
    assert names(drone.told()[-1]) == ["near", "far"]


@pytest.mark.parametrize("corners", [3, 500])
def test_too_many_zones_shrink_the_radius_and_never_the_message_beyond_its_bound(corners: int) -> None:
    here = spot(0, 0)
    points = tuple(at(10 * one, one % 2) for one in range(corners))
    zones = [
        zone(id=number, name=f"zone {number} " + "ä" * 50, reason="ö" * 200, points=points, width_m=2.0)
        for number in range(1, 300)
    ]
    far = [square(4_000 + 10 * number, id=1_000 + number, name="far") for number in range(3)]
    message = nearby(ZoneIndex([*far, *zones]), here, NOW)
    assert len(encode_message(message).encode()) < MAX_MESSAGE_BYTES
    assert message == decode_to_agent(encode_message(message))
    assert 0 < len(message.zones) < 300
    assert message.radius_m < RADIUS_M
    assert "far" not in names(message), "the nearest come first"


def test_the_nearest_corridor_is_told_wherever_it_is() -> None:
    corridors = [
        square(east_m, id=number, name=f"corridor {number}", kind=ZoneKind.CORRIDOR)
        for number, east_m in ((1, 60_000), (2, 40_000), (3, 50_000))
    ]
    message = nearby(ZoneIndex(corridors), spot(0, 0), NOW)
    assert names(message) == ["corridor 2"]
    assert message.radius_m == RADIUS_M


def test_a_change_is_told_to_a_few_agents_at_a_time() -> None:
    world = HubWorld()
    count = 3 * MAX_AT_ONCE
    world.apply(*(record(number, (1,)) for number in range(1, count + 1)))
    agents = [world.agent(number, link_id=number, takes=(ZONES,)) for number in range(1, count + 1)]
    for agent in agents:
        agent.send(position(0.0, 20.0), now=2.0)
    for tenth in range(20, 30):
        world.hub.tick(tenth / 10)

    def told() -> int:
        return sum(any(isinstance(one, NearbyZones) and one.zones for one in agent.posted) for agent in agents)

    assert told() == 0
    world.hub.zones.replace([square(200)])
    seen = [told()]
    for tenth in (30, 31):
        world.hub.tick(tenth / 10)
        seen.append(told())
    assert seen == [MAX_AT_ONCE, 2 * MAX_AT_ONCE, 3 * MAX_AT_ONCE]
