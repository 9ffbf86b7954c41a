"""Aircraft around drones: what receivers and the feed report, what people see, and the alert about what comes near."""

import json
from collections.abc import Callable

import pytest
from hub_world import record
from test_zones_geometry import M
from test_zones_of_drones import Scene, position

from server.airspace.core.aircraft.decode import Identity, Kind, Report, Threat, read
from server.airspace.core.aircraft.feed import reports_in
from server.airspace.core.aircraft.messages import AircraftHeard
from server.airspace.core.aircraft.table import AircraftTable
from server.live.live_messages import AlertChanged
from wire.control_messages import AutopilotState
from wire.dialect import build, mavlink
from wire.ids import DroneId

ICAO = 0x4B1234


def adsb(east_m: float, *, north_m: float = 0.0, east_m_s: float = 0.0, up_m: float = 120.0, **more: int) -> bytes:
    """`up_m`: above the sea."""
    values = {"flags": 1 | 2 | 4 | 8 | 16, "emitter_type": 7, "icao": ICAO, "since_s": 0} | more
    message = mavlink.MAVLink_adsb_vehicle_message(
        values["icao"], round(north_m * M * 1e7) + 1, round(east_m * M * 1e7), 0, round(up_m * 1000),
        9000 if east_m_s >= 0 else 27000, round(abs(east_m_s) * 100), 0, b"HELI1", values["emitter_type"],
        values["since_s"], values["flags"], 0,
    )  # fmt: skip
    return build(message, system_id=1, component_id=156, sequence=0)


def remote_id(east_m: float, up_m: float = 120.0, sender: int = 9) -> bytes:
    zeros = [0] * 19
    message = mavlink.MAVLink_open_drone_id_location_message(
        0, 0, [sender, *zeros], 2, 36100, 25500, 0, 1, round(east_m * M * 1e7), 0, up_m, 0, 0, 0, 0, 0, 0, 0, 0
    )
    return build(message, system_id=1, component_id=236, sequence=0)


def reported(frame: bytes, at: float) -> Report:
    report = read(frame, at)
    assert isinstance(report, Report)
    return report


def fly(scene: Scene, *frames: bytes, seconds: float = 4.0) -> None:
    for step in range(round(seconds * 5)):
        scene.be(0.0)
        if step % 5 == 0:
            scene.agent.send(*frames, now=scene.now)


def heard(scene: Scene) -> list[AircraftHeard]:
    return [one for one in scene.alice.events() if isinstance(one, AircraftHeard)]


def test_what_an_ads_b_frame_says() -> None:
    report = read(adsb(1000, east_m_s=-50.0, since_s=2), 100.0)
    assert isinstance(report, Report)
    assert (report.key, report.kind, report.name) == ("icao:4b1234", Kind.MANNED, "HELI1")
    assert report.motion.at == 98.0
    assert report.motion.alt_amsl_m == 120.0
    assert report.motion.east_m_s == pytest.approx(-50.0)
    assert read(adsb(1000, flags=0), 0.0) is None, "without a valid place it says nothing"
    unmanned = read(adsb(1000, emitter_type=14), 0.0)
    assert isinstance(unmanned, Report)
    assert unmanned.kind is Kind.UNMANNED


def test_what_remote_id_and_collision_say() -> None:
    report = read(remote_id(30.0), 5.0)
    assert isinstance(report, Report)
    assert (report.kind, report.course_deg, report.speed_m_s) == (Kind.UNMANNED, None, None)
    name = mavlink.MAVLink_open_drone_id_basic_id_message(0, 0, [9, *[0] * 19], 1, 2, [*b"SN\x0712", *[0] * 15])
    identity = read(build(name, system_id=1, component_id=236, sequence=0), 0.0)
    assert identity == Identity(report.key, "SN12")
    collision = mavlink.MAVLink_collision_message(0, ICAO, 0, 2, 12.0, 30.0, 90.0)
    threat = read(build(collision, system_id=1, component_id=1, sequence=0), 0.0)
    assert threat == Threat("icao:4b1234", 2, 12.0, 90.0, 30.0)


def test_the_table_is_bounded_for_each_receiver_and_forgets() -> None:
    table = AircraftTable()
    table.take(reported(adsb(0, icao=7), 0.0), DroneId(2), 0.0)
    for number in range(1000, 1000 + 100 + 50):
        table.take(reported(adsb(0, icao=number), number / 100), DroneId(1), number / 100)
    assert (len(table), table.left_out) == (100 + 1, 50)
    assert "icao:000007" in {one.key for one in table}, "a flood displaces nothing that another receiver hears"
    table.forget_old(1000.0)
    assert len(table) == 0


def test_an_aircraft_is_shown_to_those_who_see_the_drone_that_heard_it() -> None:
    scene = Scene()
    bob = scene.world.browser(2)
    fly(scene, adsb(9000))
    [*_, last] = heard(scene)
    [one] = last.aircraft
    assert (one.key, one.name, one.manned, one.alt_amsl_m) == ("icao:4b1234", "HELI1", True, 120.0)
    assert one.age_s < 2.0
    assert not [event for event in bob.events() if isinstance(event, AircraftHeard)]
    fly(scene, seconds=70)
    assert heard(scene)[-1].aircraft == []


def test_a_manned_aircraft_that_comes_near_is_the_first_alert() -> None:
    scene = Scene()
    scene.drone.last_heard.reported(AutopilotState(heard=True, armed=True, airborne=True))
    scene.drone.autopilot_heard = True
    fly(scene, adsb(3000, east_m_s=-60.0), seconds=6)
    words = [one.alert.words for one in scene.alice.events() if isinstance(one, AlertChanged)
             and one.alert.rule == "aircraft-near"]  # fmt: skip
    assert words
    assert words[0].startswith("Drone 1: an aircraft (HELI1) comes near: ")
    assert "to the east, at the same height" in words[0]


def test_what_flies_past_or_above_is_no_alert() -> None:
    scene = Scene()
    fly(scene, adsb(3000, east_m_s=60.0), adsb(2000, east_m_s=-60.0, up_m=1200.0, icao=7))
    assert scene.drone.aircraft_near == ("", "")


def test_a_foreign_drone_is_a_warning_and_one_of_the_towers_own_is_none() -> None:
    scene = Scene()
    fly(scene, remote_id(45.0))
    assert scene.drone.aircraft_near.unmanned.startswith("a drone of somebody else comes near: 40 m to the east")
    scene = Scene()
    fly(scene, remote_id(3.0))
    assert scene.drone.aircraft_near == ("", "")
    assert all(not one.aircraft for one in heard(scene))


class Beside(Scene):
    """Drone 2 is a stranger's, and in the air too, 4 km east. What its receiver "hears" comes at 20 Hz."""

    def __init__(self) -> None:
        super().__init__()
        self.liar = self.world.agent(2)
        other = self.hub.state.drones[DroneId(2)]
        other.armed = other.airborne = other.was_airborne = True
        self.place = position(4000.0, 20.0)

    def fly(self, heard: Callable[[], bytes], claimed: Callable[[], bytes], seconds: float = 6.0) -> None:
        for step in range(round(seconds * 5)):
            self.liar.send(self.place, *(claimed() for _ in range(4)), now=self.now)
            if step % 5 == 0:
                self.agent.send(heard(), now=self.now)
            self.be(0.0)


def test_a_strangers_receiver_hides_no_aircraft() -> None:
    """It has the same address somewhere else, newer each time."""
    scene = Beside()
    scene.fly(lambda: adsb(3000 - 60 * scene.now, east_m_s=-60.0), lambda: adsb(90_000))
    assert "an aircraft (HELI1) comes near" in scene.drone.aircraft_near.manned


def test_a_strangers_drone_beside_an_aircraft_makes_it_nobodys_own() -> None:
    scene = Beside()

    def aircraft() -> bytes:
        return adsb(4000 - 60 * scene.now, east_m_s=-60.0, up_m=120.0)

    for _ in range(100):  # 20 s beside it
        scene.place = position(4000 - 60 * scene.now, 20.0, east_m_s=-60.0)
        scene.fly(aircraft, aircraft, seconds=0.2)
    assert "an aircraft (HELI1) comes near" in scene.drone.aircraft_near.manned


def test_a_strangers_receiver_invents_no_aircraft_and_one_of_the_same_people_counts() -> None:
    scene = Beside()
    scene.fly(lambda: adsb(90_000, icao=1), lambda: adsb(3000 - 60 * scene.now, east_m_s=-60.0))
    assert scene.drone.aircraft_near == ("", "")
    scene.world.apply(record(1, (1,), holder=1), record(2, (1, 2)))
    scene.fly(lambda: adsb(90_000, icao=1), lambda: adsb(3000 - 60 * scene.now, east_m_s=-60.0))
    assert "an aircraft (HELI1) comes near" in scene.drone.aircraft_near.manned


def test_the_collision_of_a_strangers_autopilot_threatens_its_own_drone_alone() -> None:
    scene = Beside()
    collision = build(
        mavlink.MAVLink_collision_message(0, ICAO, 0, 2, 12.0, 30.0, 90.0), system_id=1, component_id=1, sequence=0
    )
    scene.fly(lambda: adsb(9000), lambda: collision)
    assert scene.drone.aircraft_near == ("", "")


FEED = {
    "now": 1.0,
    "aircraft": [
        {"hex": "4B1234", "flight": "HELI1  ", "lat": 0.0, "lon": 0.02, "alt_geom": 400, "gs": 100, "track": 270},
        {"hex": "3c0000", "lat": 40.0, "lon": 8.0, "alt_baro": "ground"},
        {"hex": "3c0001", "lat": "no", "lon": 8.0},
        {"hex": "3c0002", "lat": 1.0, "lon": 1.0, "seen_pos": 900},
        7,
    ],
}


def test_a_feed_is_read_and_only_what_is_near_a_drone_is_kept() -> None:
    reports = reports_in(json.dumps(FEED).encode(), 50.0)
    assert [one.key for one in reports] == ["icao:4b1234", "icao:3c0000"]
    assert reports[0].motion.alt_amsl_m == pytest.approx(121.92)
    assert reports[0].speed_m_s == pytest.approx(51.44, abs=0.01)
    assert reports[1].on_ground
    scene = Scene()
    bob = scene.world.browser(2)
    scene.hub.aircraft.feed(reports_in(json.dumps(FEED).encode(), scene.now), scene.now)
    fly(scene, seconds=2)
    assert [one.key for one in heard(scene)[-1].aircraft] == ["icao:4b1234"]
    assert not [event for event in bob.events() if isinstance(event, AircraftHeard)], "his drone is not there"


@pytest.mark.parametrize("content", [b"", b"[]", b"{}", b'{"aircraft": 1}', b"x" * 4_000_001])
def test_what_is_no_feed(content: bytes) -> None:
    with pytest.raises(ValueError):
        reports_in(content, 0.0)
