"""Every rule of the alerts in a flight: a simulated vehicle, the real agent and the hub. Each opens once and clears.

The rules about the tower itself are in `test_tower_alerts.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Final

import msgspec
import pytest
from alert_flight import FlownHub, M
from hub_world import FakeAgent
from worlds.held_copter import mode_command

from server.alerts.core.rules import RULES
from simulator.airframe_model import AirframeModel
from simulator.failure_modes import Failure
from simulator.modes import Mode
from simulator.notices import Severity
from wire.black_box import BlackBoxState
from wire.control_messages import AutopilotState
from wire.dialect import build, mavlink
from wire.signing_key import Signing
from wire.zones.kinds import ZoneKind, ZoneRule
from wire.zones.zone import Zone, ZoneShape

Scene = Iterator[None]
SCENES: Final[dict[str, tuple[dict[str, Any], Callable[[FlownHub], Scene]]]] = {}
"""Of each rule: options of the flight, and what makes it (until the yield) and ends it."""
OPENS_WITHIN_S, CLOSES_WITHIN_S = 40.0, 130.0


def scene(*rules: str, **options: Any) -> Callable[[Callable[[FlownHub], Scene]], Callable[[FlownHub], Scene]]:
    def kept(made: Callable[[FlownHub], Scene]) -> Callable[[FlownHub], Scene]:
        SCENES.update(dict.fromkeys(rules, (options, made)))
        return made

    return kept


@scene("link-lost")
def the_link_breaks_in_the_air(flown: FlownHub) -> Scene:
    flown.link_down()
    yield
    flown.link_up()


@scene("link-lost-on-ground", starts="armed")
def the_link_breaks_while_it_is_armed(flown: FlownHub) -> Scene:
    flown.link_down()
    yield
    flown.link_up()


@scene("silent")
def the_autopilot_says_nothing(flown: FlownHub) -> Scene:
    flown.fail(Failure.SILENT, 12.0)
    yield


@scene("gps")
def the_satellites_are_gone(flown: FlownHub) -> Scene:
    flown.fail(Failure.GPS_LOST, 6.0)
    yield


@scene("failsafe", "emergency", parameters=(("FS_THR_ENABLE", 1.0),))
def the_transmitter_is_lost(flown: FlownHub) -> Scene:
    flown.hand = None
    flown.send(mode_command(Mode.GUIDED))
    flown.pass_time(4.0)  # sticks in force would hide it
    flown.fail(Failure.RADIO_LOST, 6.0)
    yield


@scene("battery-low", parameters=(("BATT_FS_LOW_ACT", 0.0),))
def the_battery_sags_a_little(flown: FlownHub) -> Scene:
    battery = flown.vehicle.flight.battery
    battery.used_mah = battery.capacity_mah * 0.85
    yield
    battery.used_mah = 0.0


@scene("battery-critical", parameters=(("BATT_FS_LOW_ACT", 0.0), ("BATT_FS_CRT_ACT", 0.0)))
def the_battery_is_nearly_empty(flown: FlownHub) -> Scene:
    battery = flown.vehicle.flight.battery
    battery.used_mah = battery.capacity_mah * 0.96
    yield
    flown.send(mode_command(Mode.LAND))  # the autopilot keeps what it has found until it starts again
    flown.pass_until(lambda: not flown.vehicle.flight.armed, within_s=60.0)


@scene("battery-on-ground", starts="parked")
def the_battery_is_nearly_empty_on_the_bench(flown: FlownHub) -> Scene:
    battery = flown.vehicle.flight.battery
    battery.used_mah = battery.capacity_mah * 0.97
    yield
    battery.used_mah = 0.0


@scene(
    "fence-breached",
    parameters=(("FENCE_ENABLE", 1.0), ("FENCE_TYPE", 1.0), ("FENCE_ALT_MAX", 30.0), ("FENCE_ACTION", 0.0)),
)
def it_climbs_over_its_fence(flown: FlownHub) -> Scene:
    flown.hand = (0, 900)
    yield
    flown.hand = (0, 200)
    flown.pass_until(lambda: flown.copter.height_m < 25.0)
    flown.hand = (0, 500)


@scene("height-limit", height_limit_m=30.0)
def it_climbs_over_the_limit_of_the_tower(flown: FlownHub) -> Scene:
    flown.hand = (0, 900)
    yield
    flown.hand = (0, 200)
    flown.pass_until(lambda: flown.copter.height_m < 25.0)
    flown.hand = (0, 500)


def no_fly(flown: FlownHub, south_m: float) -> Zone:
    lat, lon = flown.place
    near, far = lat + south_m * M, lat + (south_m + 200.0) * M
    corners = ((near, lon - 200 * M), (near, lon + 200 * M), (far, lon + 200 * M), (far, lon - 200 * M))
    return Zone(
        id=1, name="Airport", kind=ZoneKind.NO_FLY, rule=ZoneRule.REFUSE, shape=ZoneShape(points=corners, width_m=None)
    )


@scene("zone-near")
def a_zone_begins_beside_it(flown: FlownHub) -> Scene:
    flown.hub.zones.replace([no_fly(flown, 5.0)])
    yield
    flown.hub.zones.replace([])


@scene("zone-breached")
def a_zone_begins_around_it(flown: FlownHub) -> Scene:
    flown.hub.zones.replace([no_fly(flown, -100.0)])
    yield
    flown.hub.zones.replace([])


@scene("aircraft-near")
def an_aeroplane_comes(flown: FlownHub) -> Scene:
    lat, lon = flown.place
    flown.hear(
        mavlink.MAVLink_adsb_vehicle_message(
            0x4B1234,
            round((lat + 500 * M) * 1e7),
            round(lon * 1e7),
            0,
            540_000,
            18_000,
            3_000,
            0,
            b"HELI1",
            7,
            0,
            31,
            0,
        ),
        156,
    )
    yield
    flown.heard_besides.clear()


@scene("foreign-drone-near")
def a_foreign_drone_comes(flown: FlownHub) -> Scene:
    lat, lon = flown.place
    zeros = [0] * 19
    flown.hear(
        mavlink.MAVLink_open_drone_id_location_message(
            0, 0, [9, *zeros], 2, 36100, 25500, 0, round((lat + 30 * M) * 1e7), round(lon * 1e7), 0, 510.0,
            0, 0, 0, 0, 0, 0, 0, 0,
        ),
        236,
    )  # fmt: skip
    yield
    flown.heard_besides.clear()


def beside(flown: FlownHub, north_m: float, *, north_m_s: float = 0.0) -> None:
    if flown.other is None:
        flown.other = FakeAgent(flown.hub, 2, link_id=900, now=flown.now)
        state = AutopilotState(heard=True, armed=True, airborne=True)
        flown.hub.reports.receive(flown.other.link, state, flown.hub.state.clock())
    lat, lon = flown.place
    height = round(flown.copter.height_m * 1000)
    where = mavlink.MAVLink_global_position_int_message(
        0, round((lat + north_m * M) * 1e7), round(lon * 1e7), 488_000 + height, height, round(north_m_s * 100), 0, 0, 0
    )
    flown.neighbour = build(where, system_id=1, component_id=1, sequence=0)


@scene("too-near")
def another_drone_is_beside_it(flown: FlownHub) -> Scene:
    beside(flown, 5.0)
    yield
    beside(flown, 800.0)


@scene("near")
def another_drone_comes_towards_it(flown: FlownHub) -> Scene:
    beside(flown, 70.0, north_m_s=-5.0)
    yield
    beside(flown, 800.0)


@scene("unattended")
def nobody_has_the_controls(flown: FlownHub) -> Scene:
    flown.lease(None)
    yield
    flown.lease(1)


@scene("armed-unattended", starts="armed")
def nobody_flies_what_is_armed(flown: FlownHub) -> Scene:
    flown.lease(None)
    yield
    flown.lease(1)


@scene("on-hold")
def an_admin_takes_it(flown: FlownHub) -> Scene:
    flown.take()
    yield
    flown.lease(1)
    flown.holder_is(present=True)
    flown.hand = (0, 500)


@scene("hold-unconfirmed")
def a_hold_gets_no_answer(flown: FlownHub) -> Scene:
    flown.fail(Failure.MAVLINK_MUTE, 9.0)
    flown.pass_time(0.5)
    flown.take()
    yield
    flown.pass_time(10.0)
    flown.take()


@scene("lost-action-counting", "lost-action", settings={"lost_action_s": 10.0})
def nobody_flies_it_any_more(flown: FlownHub) -> Scene:
    flown.hand = None
    flown.holder_is(present=False)
    yield
    flown.pass_time(1.0)
    flown.holder_is(present=True)
    flown.hand = (0, 500)


@scene("motion")
def its_position_jumps(flown: FlownHub) -> Scene:
    flown.vehicle.flight.body.north_m += 900.0
    yield


@scene("sensor")
def its_second_gps_loses_its_fix(flown: FlownHub) -> Scene:
    assert flown.end is not None
    drone = flown.hub.state.drones[flown.end.link.drone_id]
    for fix in (1, 3):
        message = mavlink.MAVLink_gps2_raw_message(1, fix, 470000000, 80000000, 500000, 80, 80, 0, 0, 9, 0, 0)
        drone.telemetry.newest[message.id, 0] = build(message, system_id=1, component_id=1, sequence=0)
        if fix == 1:
            yield


@scene("estimator", flight={"model": AirframeModel.SENSING})
def its_compass_is_disturbed(flown: FlownHub) -> Scene:
    flown.fail(Failure.COMPASS_JUMP, 4.0)
    yield


@scene("vibration", flight={"model": AirframeModel.SENSING})
def it_vibrates(flown: FlownHub) -> Scene:
    flown.fail(Failure.IMU_NOISE, 9.0)
    yield


@scene("autopilot-error")
def the_autopilot_reports_an_error(flown: FlownHub) -> Scene:
    flown.vehicle.flight.notify(Severity.ERROR, "Gyros inconsistent")
    yield


@scene("deaf-autopilot", starts="parked")
def the_way_to_it_is_cut(flown: FlownHub) -> Scene:
    flown.fail(Failure.DEAF, 20.0)
    yield


@scene("falls")
def a_motor_stops(flown: FlownHub) -> Scene:
    flown.fail(Failure.MOTOR_LOST, 10.0)
    yield


@scene("motors-stopped")
def somebody_disarms_it_in_the_air(flown: FlownHub) -> Scene:
    flown.vehicle.flight.disarm()
    yield
    flown.hand = None
    flown.pass_time(6.0)
    flown.arm()


@scene("sinks")
def it_holds_and_has_too_little_thrust(flown: FlownHub) -> Scene:
    flown.take()
    flown.pass_time(4.0)
    flown.vehicle.flight.body.motor_health[:] = [0.43] * 4
    yield
    flown.vehicle.flight.body.motor_health[:] = [1.0] * 4


@scene("crashed")
def it_hits_the_ground(flown: FlownHub) -> Scene:
    flown.fail(Failure.MOTOR_LOST, 6.0)
    yield
    flown.hand = None
    flown.pass_time(4.0)  # its last centred sticks end: with them it does not arm
    flown.arm()


@scene("other-autopilot")
def another_autopilot_is_on_its_line(flown: FlownHub) -> Scene:
    assert flown.end is not None
    link, clock = flown.end.link, flown.hub.state.clock
    state = AutopilotState(heard=True, armed=True, airborne=True, system_id=1, other_systems=(2,))
    flown.hub.reports.receive(link, state, clock())
    yield
    flown.hub.reports.receive(link, msgspec.structs.replace(state, other_systems=()), clock())


@scene("wrong-signing-key")
def its_autopilot_signs_with_another_key(flown: FlownHub) -> Scene:
    assert flown.end is not None
    link, clock = flown.end.link, flown.hub.state.clock
    state = AutopilotState(heard=False, armed=False, airborne=False, system_id=1, signing=Signing.WRONG_KEY)
    flown.hub.reports.receive(link, state, clock())
    yield
    fits = msgspec.structs.replace(state, heard=True, signing=Signing.ON)
    flown.hub.reports.receive(link, fits, clock())


@scene("noisy-drone")
def it_floods_texts(flown: FlownHub) -> Scene:
    assert flown.end is not None
    text = build(mavlink.MAVLink_statustext_message(6, b"hello", 0, 0), system_id=1, component_id=1, sequence=0)
    for _ in range(20):
        flown.end.send(*[text] * 10, now=flown.now)
    yield


@scene("black-box")
def its_disk_is_full(flown: FlownHub) -> Scene:
    assert flown.end is not None
    link, clock = flown.end.link, flown.hub.state.clock
    flown.hub.reports.receive(link, BlackBoxState(now_us=1, problem="its disk is full"), clock())
    yield
    flown.hub.reports.receive(link, BlackBoxState(now_us=2), clock())


def test_a_fall_is_told_within_two_seconds_though_a_hand_is_on_the_sticks() -> None:
    flown = FlownHub()
    flown.watch()
    flown.take_off()
    flown.pass_time(3.0)
    flown.fail(Failure.MOTOR_LOST, 10.0)
    flown.pass_until(lambda: flown.is_open("falls"), within_s=2.0)


def test_a_take_out_of_a_full_descent_is_no_alarm() -> None:
    flown = FlownHub()
    flown.watch()
    flown.take_off()
    flown.hand = (0, 1000)
    flown.pass_time(6.0)
    flown.hand = (0, 0)
    flown.pass_time(3.0)
    flown.take()
    flown.pass_time(8.0)
    flown.tell()
    assert flown.opened("sinks") == 0


@pytest.mark.parametrize("rule", [rule.name for rule in RULES if rule.tower_condition is None])
def test_it_opens_once_and_clears(rule: str) -> None:
    options, made = SCENES[rule]
    starts = options.get("starts", "flying")
    flown = FlownHub(**{name: value for name, value in options.items() if name != "starts"})
    flown.watch()
    if starts == "flying":
        flown.take_off()
    elif starts == "armed":
        flown.arm()
    flown.pass_time(3.0)
    flown.tell()
    assert not flown.is_open(rule), "nothing has happened yet"
    flown.watch()
    acted = made(flown)
    next(acted)
    flown.pass_until(lambda: flown.is_open(rule), within_s=OPENS_WITHIN_S)
    flown.pass_time(1.0)
    next(acted, None)
    flown.pass_until(lambda: not flown.is_open(rule), within_s=CLOSES_WITHIN_S)
    flown.pass_time(3.0)
    flown.tell()
    assert flown.opened(rule) == 1
    assert flown.seen[rule][-1][1], "people were told of its end"
