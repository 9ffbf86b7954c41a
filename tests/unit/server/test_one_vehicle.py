"""Whatever other vehicles say on a drone's line, tower, recordings and imports have one vehicle."""

import io
from typing import Any, Final

from hub_world import FakeAgent, HubWorld, record
from hypothesis import given
from hypothesis import strategies as st

from server.flights.api.export_stream import FORMATS
from server.flights.core.figures import FiguresReader
from server.flights.core.imports.conversion import convert
from server.flights.core.tlog import STAMP, Entry, of_one_vehicle, read_entries
from server.flights.core.track import FlightSummary, fixes_in
from wire.control_messages import AutopilotState
from wire.dialect import build, mavlink
from wire.ids import DroneId

M: Final = mavlink
BEGAN_US: Final = 1_800_000_000_000_000


def said(message: Any, system: int, component: int = 1) -> bytes:
    return build(message, system_id=system, component_id=component, sequence=0)


def beat(system: int, number: int) -> bytes:
    armed = 0x80 if number % 2 else 0
    return said(M.MAVLink_heartbeat_message(2, 3, armed | 1, number % 7, 4, 3), system)


def place(system: int, number: int) -> bytes:
    lat = round((47.0 + system + number / 1e4) * 1e7)
    return said(M.MAVLink_global_position_int_message(number, lat, 85_000_000, 0, number * 100, 100, 0, 0, 0), system)


def battery(system: int, number: int) -> bytes:
    return said(M.MAVLink_sys_status_message(0, 0, 0, 0, 11_000, 0, number % 100, 0, 0, 0, 0, 0, 0), system)


def landed(system: int, number: int) -> bytes:
    return said(M.MAVLink_extended_sys_state_message(0, number % 3), system)


MAKERS: Final = (beat, place, battery, landed)
FOREIGN: Final = st.tuples(st.sampled_from((2, 3)), st.sampled_from(MAKERS), st.integers(0, 200))
STRANGERS: Final = st.lists(st.lists(FOREIGN, max_size=3), min_size=24, max_size=24)


def line(strangers: list[list[Any]]) -> list[tuple[float, bytes]]:
    """Frames of one line with their times. The drone's own system begins, and says something each quarter of a
    second."""
    frames: list[tuple[float, bytes]] = [(0.0, beat(1, 1))]
    for step, others in enumerate(strangers):
        at = step / 4
        frames += [(at, makes(system, number)) for system, makes, number in others]
        frames.append((at, MAKERS[step % 4](1, 2 * step + 1)))
    return frames


def seen_by_the_tower(strangers: list[list[Any]]) -> list[Any]:
    """The agent is of before: it passes all that it hears."""
    world = HubWorld()
    world.apply(record(1, (1,)))
    browser = world.browser(1)
    agent = FakeAgent(world.hub, 1, link_id=9, now=0.0)
    state = AutopilotState(heard=True, armed=True, airborne=True)
    world.hub.reports.receive(agent.link, state, world.hub.state.clock())
    for at, frame in line(strangers):
        agent.send(frame, now=at)
    world.hub.tick(8.0)
    drone = world.hub.state.drones[DroneId(1)]
    drone.telemetry.decode(8.0)
    return [
        drone.view(),
        drone.position_frame,
        drone.heartbeat,
        drone.telemetry.battery_percent,
        browser.frames(),
    ]


def tlog(strangers: list[list[Any]]) -> bytes:
    return b"".join(STAMP.pack(BEGAN_US + round(at * 1e6)) + frame for at, frame in line(strangers))


def summed(log: bytes) -> list[Any]:
    """Figures, way and exports of a recording that holds all of the line."""
    entries = list(of_one_vehicle(read_entries(io.BytesIO(log))))
    summary, reader = FlightSummary(BEGAN_US), FiguresReader([], BEGAN_US)
    for entry in entries:
        before_m = summary.distance_m
        plain = Entry(entry.at_us, entry.frame, 0)
        summary.take(plain)
        reader.take(plain, summary.distance_m - before_m)
    exports = ["".join(one.export("a flight", fixes_in(iter(entries)))) for one in FORMATS.values()]
    flown = [summary.frames, summary.last_us, summary.distance_m, summary.max_height_m, summary.track]
    return [flown, reader.figures(max_height_m=summary.max_height_m), exports]


def imported(log: bytes) -> tuple[bytes, Any]:
    out = io.BytesIO()
    converted = convert(log, out, uploaded_us=BEGAN_US, max_bytes=10**7)
    return out.getvalue(), converted


@given(STRANGERS)
def test_nothing_of_another_vehicle_gets_into_tower_statistics_exports_or_imports(strangers: list[list[Any]]) -> None:
    alone: list[list[Any]] = [[] for _ in strangers]
    assert seen_by_the_tower(strangers) == seen_by_the_tower(alone)
    assert summed(tlog(strangers)) == summed(tlog(alone))
    assert imported(tlog(strangers)) == imported(tlog(alone))


def test_what_a_ground_station_sent_stays_in_a_recording() -> None:
    sticks = said(M.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0), 255, 190)
    log = tlog([]) + STAMP.pack(BEGAN_US + 10) + sticks
    assert [entry.frame for entry in of_one_vehicle(read_entries(io.BytesIO(log)))][-1] == sticks
