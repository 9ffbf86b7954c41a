"""Zones at the hub: which drone they count for, what of plans, go-tos and sticks they refuse, who is told."""

from dataclasses import replace
from datetime import timedelta

import pytest
from hub_world import HubWorld, record, sticks
from test_zones_geometry import M, at, zone

from server.airspace.core.zones.check import plan_judge
from server.airspace.core.zones.messages import ZonesChanged
from server.kernel.fleet import TeamRecord
from server.kernel.people import Principal
from server.kernel.relations import TeamRole
from server.live.hub_events import HubEvent, ZoneReached
from server.live.live_messages import Notice
from server.operations.core.permissions import refuse_commands, refuse_plan
from server.operations.core.refusals import ZoneForbids
from wire.dialect import build, mavlink
from wire.ids import DroneId, UserId
from wire.plans import PlanItem, PlanKind
from wire.tagged import tag
from wire.transactions import CommandWork
from wire.zones.kinds import ZoneKind, ZoneRule

HOME_AMSL_M = 100.0
AHEAD = tuple(at(*one) for one in ((200, -50), (300, -50), (300, 50), (200, 50)))
"""200 to 300 m east of home."""


def position(east_m: float, up_m: float, *, east_m_s: float = 0.0) -> bytes:
    lat, lon = at(east_m, 0.0)
    values = (0, round(lat * 1e7) + 1, round(lon * 1e7), round((HOME_AMSL_M + up_m) * 1000), round(up_m * 1000))
    message = mavlink.MAVLink_global_position_int_message(*values, 0, round(east_m_s * 100), 0, 0)
    return build(message, system_id=1, component_id=1, sequence=0)


def waypoint(east_m: float, up_m: float = 20.0, command: int = 16) -> PlanItem:
    lat, lon = at(east_m, 0.0)
    return PlanItem(command, 3, (0.0, 0.0, 0.0, 0.0), round(lat * 1e7), round(lon * 1e7), up_m)


def go_to(east_m: float, up_m: float = 20.0, command: int = mavlink.MAV_CMD_DO_REPOSITION) -> CommandWork:
    lat, lon = at(east_m, 0.0)
    params = (-1.0, 0.0, 0.0, None, 0.0, 0.0, up_m)
    return CommandWork(command, params, frame=6, x=round(lat * 1e7), y=round(lon * 1e7))


class Scene:
    """alice flies drone 1 by hand, at home."""

    def __init__(self) -> None:
        self.world = HubWorld()
        self.world.apply(record(1, (1,), holder=1), record(2, (2,)))
        self.hub = self.world.hub
        self.events: list[HubEvent] = []
        self.hub.state.on_event = self.events.append
        self.agent = self.world.agent(1)
        self.alice = self.world.browser(1)
        self.drone = self.hub.state.drones[DroneId(1)]
        self.now = 0.0
        home = mavlink.MAVLink_home_position_message(10, 0, 100_000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0)
        self.agent.send(build(home, system_id=1, component_id=1, sequence=0))
        self.be(0.0)
        self.drone.airborne = self.drone.was_airborne = self.drone.armed = True

    @property
    def person(self) -> Principal:
        return self.alice.browser.viewer

    def be(self, east_m: float, *, up_m: float = 20.0, east_m_s: float = 0.0) -> None:
        self.now += 0.2
        self.agent.send(position(east_m, up_m, east_m_s=east_m_s), now=self.now)
        self.hub.tick(self.now)

    def notices(self) -> list[str]:
        return [one.text for one in self.alice.events() if isinstance(one, Notice) and one.code == "zone"]


def judge_plan(scene: Scene, kind: PlanKind, items: list[PlanItem]) -> None:
    refuse_plan(scene.drone, scene.person, kind, items, plan_judge(scene.drone)(kind, items))


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_a_plan_into_a_zone_is_refused_and_names_zone_and_item(scene: Scene) -> None:
    scene.hub.zones.replace([zone(points=AHEAD, reason="helicopter")])
    with pytest.raises(ZoneForbids) as refused:
        judge_plan(scene, PlanKind.MISSION, [waypoint(50), waypoint(150), waypoint(400)])
    assert str(refused.value) == ("item 3: the way of Drone 1 there leads into the no-fly zone Airport (helicopter)")
    assert refused.value.item == 2
    judge_plan(scene, PlanKind.MISSION, [waypoint(50), waypoint(150)])
    judge_plan(scene, PlanKind.FENCE, [waypoint(250, command=5003)])
    with pytest.raises(ZoneForbids):
        judge_plan(scene, PlanKind.RALLY, [waypoint(250, command=5100)])


def test_a_plan_over_a_low_zone_is_free_and_a_circle_into_one_is_not(scene: Scene) -> None:
    scene.hub.zones.replace([zone(points=AHEAD, ceiling_m=50.0)])
    judge_plan(scene, PlanKind.MISSION, [waypoint(0, 60.0), waypoint(400, 60.0)])
    wide = PlanItem(18, 3, (2.0, 0.0, 60.0, 0.0), waypoint(150).x, waypoint(150).y, 20.0)
    with pytest.raises(ZoneForbids):
        judge_plan(scene, PlanKind.MISSION, [wide])


def test_a_jump_back_over_a_zone_is_a_way_too(scene: Scene) -> None:
    scene.hub.zones.replace([zone(points=AHEAD)])
    north = PlanItem(16, 3, (0.0,) * 4, round(200 * M * 1e7), round(150 * M * 1e7), 20.0)
    east = PlanItem(16, 3, (0.0,) * 4, round(200 * M * 1e7), round(350 * M * 1e7), 20.0)
    beyond = waypoint(350)
    jump = PlanItem(177, 2, (0.0, 3.0, 0.0, 0.0))
    judge_plan(scene, PlanKind.MISSION, [waypoint(150), north, east, beyond])
    with pytest.raises(ZoneForbids) as refused:
        judge_plan(scene, PlanKind.MISSION, [waypoint(150), north, east, beyond, jump])
    assert refused.value.item == 4


def test_a_go_to_into_or_through_a_zone_is_refused(scene: Scene) -> None:
    scene.hub.zones.replace([zone(points=AHEAD)])
    for east_m in (250, 400):
        with pytest.raises(ZoneForbids, match="leads into the no-fly zone Airport"):
            refuse_commands(scene.drone, scene.person, [go_to(east_m)])
    refuse_commands(scene.drone, scene.person, [go_to(150)])
    refuse_commands(scene.drone, scene.person, [go_to(250, command=mavlink.MAV_CMD_NAV_LAND)])
    refuse_commands(scene.drone, scene.person, [CommandWork(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH)])


def test_inside_a_go_to_leads_out_and_not_deeper(scene: Scene) -> None:
    scene.be(220)
    scene.hub.zones.replace([zone(points=AHEAD)])
    for east_m in (150, 210):
        refuse_commands(scene.drone, scene.person, [go_to(east_m)])
    with pytest.raises(ZoneForbids):
        refuse_commands(scene.drone, scene.person, [go_to(240)])


def test_a_zone_that_warns_lets_pass_and_tells(scene: Scene) -> None:
    scene.hub.zones.replace([zone(points=AHEAD, rule=ZoneRule.WARN)])
    refuse_commands(scene.drone, scene.person, [go_to(250)])
    judge_plan(scene, PlanKind.MISSION, [waypoint(250)])
    assert scene.notices() == [
        "The way of Drone 1 leads into the no-fly zone Airport. This zone only warns.",
        "Item 1: the way of Drone 1 leads into the no-fly zone Airport. This zone only warns.",
    ]


def test_a_raw_frame_is_judged_as_an_operation_is(scene: Scene) -> None:
    scene.hub.zones.replace([zone(points=AHEAD)])
    lat, lon = at(250, 0)
    message = mavlink.MAVLink_command_int_message(
        1, 1, 6, 192, 0, 0, -1, 0, 0, float("nan"), round(lat * 1e7), round(lon * 1e7), 20
    )
    frame = build(message, system_id=255, component_id=190, sequence=0)
    scene.agent.received()
    scene.alice.send(tag(scene.drone.drone_id, frame), now=scene.now)
    assert scene.agent.received() == []
    assert scene.notices() == ["Nothing was sent to Drone 1: its way leads into the no-fly zone Airport."]


def test_flown_by_hand_at_a_zone_it_is_told_and_then_held(scene: Scene) -> None:
    scene.hub.zones.replace([zone(points=AHEAD)])
    for step in range(60):
        if step % 5 == 0:
            scene.alice.send(tag(scene.drone.drone_id, sticks()), now=scene.now)
        scene.be(60 + 2 * step, east_m_s=10.0)
        if any(isinstance(one, ZoneReached) for one in scene.events):
            break
    [event] = [one for one in scene.events if isinstance(one, ZoneReached)]
    assert (event.user_id, event.zone, event.why) == (UserId(1), "Airport", "at the edge of the no-fly zone Airport")
    assert 165 <= 60 + 2 * step <= 178
    assert "Drone 1 holds: at the edge of the no-fly zone Airport." in scene.notices()
    assert scene.drone.zone_watch.situation.near.startswith("reaches the no-fly zone Airport")


def test_on_its_way_home_no_zone_stops_it(scene: Scene) -> None:
    scene.hub.zones.replace([zone(points=AHEAD)])
    returning = mavlink.MAVLink_heartbeat_message(2, 3, 81 | 128, 6, 4, 3)
    scene.agent.send(build(returning, system_id=1, component_id=1, sequence=0), now=scene.now)
    scene.alice.send(tag(scene.drone.drone_id, sticks()), now=scene.now)
    for east_m in range(150, 260, 2):
        scene.be(east_m, east_m_s=10.0)
    assert not [one for one in scene.events if isinstance(one, ZoneReached)]
    assert scene.drone.zone_watch.situation.breach == "is in the no-fly zone Airport"


def test_a_teams_zone_counts_for_its_drones_and_is_seen_by_its_people(scene: Scene) -> None:
    now = scene.hub.state.clock()
    team = TeamRecord(7, "Coast", {UserId(1): TeamRole.OPERATOR}, now)
    scene.world.apply(replace(record(1, (1,), holder=1), team=team), record(2, (2,)))
    bob = scene.world.browser(2)
    scene.alice.events()
    scene.hub.zones.replace([zone(points=AHEAD, team_id=7)])
    assert any(isinstance(one, ZonesChanged) for one in scene.alice.events())
    assert not any(isinstance(one, ZonesChanged) for one in bob.events())
    assert scene.drone.zones
    assert not scene.hub.state.drones[DroneId(2)].zones
    assert len(scene.hub.zones.visible(scene.person)) == 1
    assert scene.hub.zones.visible(bob.browser.viewer) == []
    assert len(scene.hub.zones.visible(bob.browser.viewer, {7})) == 1


def test_a_zone_counts_from_its_time_to_its_time(scene: Scene) -> None:
    now = scene.hub.state.clock()
    before = zone(points=AHEAD, id=1, valid_until=now)
    after = zone(points=AHEAD, id=2, valid_from=now + timedelta(seconds=1))
    during = zone(points=AHEAD, id=3, valid_from=now, valid_until=now + timedelta(seconds=1))
    scene.hub.zones.replace([before, after, during])
    assert [one.id for one in scene.drone.zones.zones] == [3]
    scene.hub.zones.replace([])
    assert not scene.drone.zones


def test_take_off_inside_a_zone_is_refused_and_a_corridor_begins_where_it_is(scene: Scene) -> None:
    scene.drone.airborne = False
    scene.hub.zones.replace([zone(points=tuple(at(*one) for one in ((-9, -9), (9, -9), (9, 9), (-9, 9))))])
    take_off = CommandWork(mavlink.MAV_CMD_NAV_TAKEOFF, (0.0, 0.0, 0.0, None, 0.0, 0.0, 30.0))
    with pytest.raises(ZoneForbids):
        refuse_commands(scene.drone, scene.person, [take_off])
    scene.hub.zones.replace([zone(ZoneKind.CORRIDOR, points=(at(0, 0), at(500, 0)), width_m=40.0)])
    refuse_commands(scene.drone, scene.person, [take_off])
