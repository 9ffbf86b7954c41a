"""An attacker flies a made-up drone at a drone hidden from its owner, to find the hidden position.

bob's agent reports whatever he likes. alice's drone 1 is hidden, and she flies it by hand all the time. bob may learn
only what a pilot needs to avoid it, from an armed and credible drone, now and then. A drone that is not credible must
not alarm alice, and all her sticks and frames pass. Time is simulated here; test_tenants_beside_a_flight.py searches
through a real tower.
"""

from math import cos, radians
from typing import Any, Final

import msgspec
import pytest
from hub_world import FakeAgent, FakeBrowser, HubWorld, record, sticks

from server.airspace.core.separation.motion import METRES_PER_DEGREE
from server.airspace.core.separation.strangers import ALERT_BURST, ALERT_EVERY_S, FIGURES_EVERY_S
from server.kernel.people import Role
from server.live import live_messages as live
from server.live.hub_events import HolderExpired, HolderGone, HubEvent, MotionSuspected, RightLost, RttTooLong
from wire.control_messages import AutopilotState, HoldOrder
from wire.dialect import build, mavlink
from wire.frames import message_id
from wire.ids import DroneId, UserId
from wire.tagged import split_tagged, tag

HIDDEN: Final = 1
MADE_UP: Final = 2
ARMED: Final = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
QUAD: Final = mavlink.MAV_TYPE_QUADROTOR
ARDUPILOT: Final = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
TICK_S: Final = 0.1
WRONG: Final = HolderGone | HolderExpired | RightLost | RttTooLong
"""Events that would hold a drone or take it from its pilot."""
Place = tuple[float, float, float]


def position(place: Place, speed: tuple[float, float, float], at: float) -> bytes:
    """Returns a position frame. `place` and `speed`: metres north, east and up of a reference point."""
    north_m, east_m, up_m = place
    lat_e7 = round((47.0 + north_m / METRES_PER_DEGREE) * 1e7)
    lon_e7 = round((8.0 + east_m / METRES_PER_DEGREE / cos(radians(47.0))) * 1e7)
    up_mm, cm_s = round(up_m * 1000), (round(one * 100) for one in speed)
    message = mavlink.MAVLink_global_position_int_message(
        round(at * 1000), lat_e7, lon_e7, 400_000 + up_mm, up_mm, *cm_s, 0
    )
    return build(message, system_id=1, component_id=1, sequence=0)


class Sky(HubWorld):
    """Both drones in the air 300 m apart, as their agents report; everybody watches."""

    def __init__(self, *, hidden: Place = (0.0, 0.0, 50.0)) -> None:
        super().__init__()
        self.noticed: list[HubEvent] = []
        self.hub.state.on_event = self.noticed.append
        self.now = 0.0
        self.places: dict[int, Place] = {HIDDEN: hidden, MADE_UP: (-300.0, 0.0, 50.0)}
        self.speeds: dict[int, Place] = {HIDDEN: (0.0, 0.0, 0.0), MADE_UP: (0.0, 0.0, 0.0)}
        self.heartbeats: dict[int, tuple[int, int, int] | None] = dict.fromkeys(self.places, (QUAD, ARDUPILOT, ARMED))
        self.agents = {number: self.agent(number) for number in self.places}
        for number in self.places:
            self.say_state(number)
        self.alice, self.bob, self.admin = self.browser(1), self.browser(2), self.browser(9)
        self.learnt: dict[str, list[dict[str, Any]]] = {"alice": [], "bob": [], "admin": []}
        self.apply(record(HIDDEN, (1,), holder=1, epoch=1), record(MADE_UP, (2,)))
        self.hub.audience.focus(self.alice.browser, DroneId(HIDDEN), 0.0)

    def say_state(self, number: int, *, armed: bool = True, airborne: bool = True) -> None:
        self.hub.reports.receive(self.agents[number].link, AutopilotState(heard=True, armed=armed, airborne=airborne))

    def fly(self, for_s: float) -> None:
        for _ in range(round(for_s / TICK_S)):
            self.now = round(self.now + TICK_S, 3)
            self.alice.send(tag(DroneId(HIDDEN), sticks()), self.now)
            for number, agent in self.agents.items():
                moved = tuple(a + v * TICK_S for a, v in zip(self.places[number], self.speeds[number], strict=True))
                self.places[number] = moved[0], moved[1], moved[2]
                up = self.speeds[number][2]
                frames = [position(self.places[number], (*self.speeds[number][:2], -up), self.now)]
                said = self.heartbeats[number]
                if said is not None and round(self.now * 10) % 10 == 0:
                    kind, autopilot, mode = said
                    frames.append(
                        build(
                            mavlink.MAVLink_heartbeat_message(kind, autopilot, mode, 5, 4, 3),
                            system_id=1,
                            component_id=1,
                            sequence=0,
                        )
                    )
                agent.send(*frames, now=self.now)
            self.hub.tick(self.now)
            for name, browser in (("alice", self.alice), ("bob", self.bob), ("admin", self.admin)):
                self.learnt[name] += heard(browser, self.now)
            if HIDDEN in self.agents:
                self.assert_alice_flies(self.agents[HIDDEN])

    def assert_alice_flies(self, agent: FakeAgent) -> None:
        """Asserts that her stick reached her drone, its frame reached her screen, and nothing holds it."""
        passed = [message_id(frame) for _, frame in agent.received(self.now)]
        assert passed == [mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL], self.now
        agent.answer_pings(self.now)
        seen = [message_id(frame) for _, frame in split_all(self.alice.frames(self.now))]
        assert seen.count(mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT) == 1, self.now
        assert not [one for one in agent.posted if isinstance(one, HoldOrder)], self.now
        assert not [one for one in self.noticed if isinstance(one, WRONG)], self.now

    def approach(self, speed_m_s: float = 10.0) -> None:
        """Flies straight from the made-up drone's position to the hidden one."""
        self.fly(12)  # positions must be plausible for this long
        self.speeds[MADE_UP] = (speed_m_s, 0.0, 0.0)
        self.fly((self.places[HIDDEN][0] - self.places[MADE_UP][0]) / speed_m_s)
        self.speeds[MADE_UP] = (0.0, 0.0, 0.0)

    def suspicion(self, browser_of: int, number: int) -> str | None:
        role = Role.ADMIN if browser_of == 9 else Role.OPERATOR
        drone = next(one for one in self.hub.squads.views(UserId(browser_of), role) if one.id == number)
        return drone.suspicious_motion


def heard(browser: FakeBrowser, now: float) -> list[dict[str, Any]]:
    """Returns the separation events received, and answers pings."""
    reported = []
    for one in browser.events():
        if isinstance(one, live.Ping):
            browser.browser.trip.pong(one.sequence, now)
        elif isinstance(one, live.Separation):
            reported.append(msgspec.json.decode(live.encode_event(one)))
    return reported


def split_all(messages: list[bytes]) -> list[tuple[DroneId, bytes]]:
    return [pair for message in messages for pair in split_tagged(message)]


def without_number(events: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [{key: value for key, value in one.items() if key != "number"} for one in events]


def test_what_an_honest_approach_learns_is_what_avoids_the_other_and_nothing_else() -> None:
    sky = Sky()
    sky.approach()
    sky.fly(20)
    reported = sky.learnt["bob"]
    assert "warning" in {one["level"] for one in reported}, "a pilot must be warned"
    for one in reported:
        assert one["drones"] == [MADE_UP, None]
        assert one["horizontal_m"] is None and one["vertical_m"] is None and one["why"] == ""
        assert one["bearing_deg"] % 30 == 0 and one["distance_m"] % 10 == 0 and one["above_m"] % 5 == 0
        assert one["in_s"] % 5 == 0
    assert len({one["number"] for one in reported}) == 1
    # Alice gets the same warnings about bob's drone, under another number.
    assert "warning" in {one["level"] for one in sky.learnt["alice"]}
    assert not {one["number"] for one in sky.learnt["alice"]} & {one["number"] for one in reported}
    raised = 2
    assert len(reported) <= 50 / FIGURES_EVERY_S + raised
    assert "alice" not in str(reported) and "Drone 1" not in str(reported)


@pytest.mark.parametrize("beside", [(2.0, 1.5, 51.0), (-1.5, 1.5, 49.0), (1.0, -2.0, 51.2)])
def test_hidden_drones_some_metres_from_each_other_cannot_be_told_apart(beside: Place) -> None:
    """The attacker hovers beside it for half a minute: each report is identical at every such position."""
    stories = []
    for hidden in ((0.0, 0.0, 50.0), beside):
        sky = Sky(hidden=hidden)
        sky.places[MADE_UP] = (-10.0, 0.0, 50.5)
        sky.fly(42)
        stories.append(without_number(sky.learnt["bob"]))
    assert stories[0] == stories[1]
    assert len(stories[0]) >= 3


@pytest.mark.parametrize("who", [HIDDEN, MADE_UP])
@pytest.mark.parametrize(
    "unfit",
    ["disarmed by its agent", "disarmed by its heartbeat", "no autopilot", "a ground station", "no heartbeat at all"],
)
def test_one_that_is_not_an_armed_autopilot_is_no_oracle_and_no_alarm(who: int, unfit: str) -> None:
    sky = Sky()
    match unfit:
        case "disarmed by its agent":
            sky.say_state(who, armed=False, airborne=True)
        case "disarmed by its heartbeat":
            sky.heartbeats[who] = (QUAD, ARDUPILOT, 0)
        case "no autopilot":
            sky.heartbeats[who] = (QUAD, mavlink.MAV_AUTOPILOT_INVALID, ARMED)
        case "a ground station":
            sky.heartbeats[who] = (mavlink.MAV_TYPE_GCS, ARDUPILOT, ARMED)
        case _:
            sky.heartbeats[who] = None
    sky.fly(6)
    sky.approach()
    sky.fly(5)
    assert sky.learnt["bob"] == [] and sky.learnt["alice"] == []
    assert "warning" in {one["level"] for one in sky.learnt["admin"]}, "who sees both is told all of it"


def test_one_that_lands_and_is_disarmed_in_the_middle_of_it_ends_it_without_a_reason() -> None:
    sky = Sky()
    sky.approach()
    assert sky.learnt["bob"][-1]["level"] == "warning"
    sky.say_state(HIDDEN, armed=False, airborne=True)
    sky.fly(3)
    end = sky.learnt["bob"][-1]
    assert (end["level"], end["why"], end["distance_m"]) == ("clear", "", None)
    count = len(sky.learnt["bob"])
    sky.fly(30)
    assert len(sky.learnt["bob"]) == count


def test_a_search_by_jumps_learns_nothing_and_alarms_nobody_but_its_own_people() -> None:
    sky = Sky()
    sky.fly(12)
    for row in range(-3, 4):
        for column in range(-3, 4):
            sky.places[MADE_UP] = (row * 100.0, column * 100.0, 50.0)
            sky.fly(1.5)
    assert sky.learnt["bob"] == [] and sky.learnt["alice"] == []
    assert sky.suspicion(2, MADE_UP) == "jump" and sky.suspicion(9, MADE_UP) == "jump"
    assert sky.suspicion(1, HIDDEN) is None
    written = [one for one in sky.noticed if isinstance(one, MotionSuspected)]
    assert [(one.drone_id, one.why) for one in written] == [(MADE_UP, "jump")]


def test_a_search_light_of_made_up_speeds_learns_nothing() -> None:
    """The attacker stays 250 m away and reports 30 m/s, in another direction every few seconds."""
    sky = Sky()
    sky.fly(12)
    for north, east in ((30.0, 0.0), (21.0, 21.0), (0.0, 30.0), (-30.0, 0.0), (30.0, 0.0)) * 3:
        sky.speeds[MADE_UP] = (north, east, 0.0)
        stays = sky.places[MADE_UP]
        for _ in range(40):
            sky.places[MADE_UP] = (stays[0] - north * TICK_S, stays[1] - east * TICK_S, stays[2])
            sky.fly(TICK_S)
    learnt_early = [one for one in sky.learnt["bob"] if one["level"] != "clear"]
    assert len(learnt_early) <= 2  # before the first five-second window is over
    assert sky.suspicion(2, MADE_UP) in ("course", "jump")


def test_flying_in_and_out_again_and_again_is_answered_only_so_often() -> None:
    sky = Sky()
    sky.places[MADE_UP] = (-75.0, 0.0, 50.0)
    sky.fly(12)
    before = sky.now
    for _ in range(30):
        for speed in (6.0, -6.0):
            sky.speeds[MADE_UP] = (speed, 0.0, 0.0)
            sky.fly(10)
    begun = {one["number"] for one in sky.learnt["bob"]}
    assert 2 <= len(begun) <= ALERT_BURST + (sky.now - before) / ALERT_EVERY_S


def test_coming_back_to_the_page_is_no_second_look() -> None:
    sky = Sky()
    sky.approach()
    said = [one for one in sky.learnt["bob"] if one["level"] != "clear"][-1]
    for _ in range(20):
        late = FakeBrowser(sky.hub, 2)
        assert heard(late, sky.now) == [said]
        sky.hub.detach_browser(late.browser, sky.now)


def test_a_drone_that_is_taken_out_of_the_tower_is_no_riddle() -> None:
    sky = Sky()
    sky.approach()
    del sky.agents[HIDDEN]
    sky.apply(record(MADE_UP, (2,)))
    sky.fly(3)
    assert (sky.learnt["bob"][-1]["level"], sky.learnt["bob"][-1]["why"]) == ("clear", "")
    assert sky.hub.state.drones.get(DroneId(HIDDEN)) is None
