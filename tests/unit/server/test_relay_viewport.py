"""Which drones a browser's map shows, and the cost of the others."""

import pytest
from hub_world import HubWorld, command_ack

from server.link.core.viewport import Viewport, place_in
from server.live.live_messages import MalformedRequest, MapShown, decode_request
from wire.dialect import build, mavlink
from wire.ids import DroneId
from wire.tagged import tag

HERE = Viewport(south_deg=47.0, west_deg=8.0, north_deg=48.0, east_deg=9.0)
PACIFIC = Viewport(south_deg=-10.0, west_deg=170.0, north_deg=10.0, east_deg=-170.0)


def position(lat_deg: float, lon_deg: float, sequence: int = 0) -> bytes:
    lat_e7, lon_e7 = round(lat_deg * 1e7), round(lon_deg * 1e7)
    message = mavlink.MAVLink_global_position_int_message(1, lat_e7, lon_e7, 0, 0, 0, 0, 0, 0)
    return build(message, system_id=1, component_id=1, sequence=sequence)


@pytest.mark.parametrize(
    ("viewport", "place", "shown"),
    [
        (HERE, (47.5, 8.5), True),
        (HERE, (47.0, 9.0), True),
        (HERE, (46.9, 8.5), False),
        (HERE, (47.5, 9.1), False),
        (PACIFIC, (0.0, 175.0), True),
        (PACIFIC, (0.0, -175.0), True),
        (PACIFIC, (0.0, 0.0), False),
        (PACIFIC, (11.0, 175.0), False),
    ],
)
def test_what_a_map_shows(viewport: Viewport, place: tuple[float, float], shown: bool) -> None:
    assert viewport.shows(*place) is shown


def test_the_place_is_read_out_of_the_frame_as_it_came() -> None:
    assert place_in(position(47.5, -8.25)) == (47.5, -8.25)
    assert place_in(position(0.0, 0.0)) is None, "no fix yet"
    assert place_in(position(0.0, 8.0)) == (0.0, 8.0)


def test_a_drone_outside_the_map_is_sent_once_a_second() -> None:
    world = HubWorld()
    agent, alice = world.agent(1), world.browser(1)
    agent.send(position(50.0, 8.5))
    world.hub.audience.show_map(alice.browser, HERE)
    alice.frames(2e9)
    agent.send(position(50.0, 8.5, sequence=1), command_ack())
    assert alice.frames(2e9 + 0.5) == [tag(DroneId(1), command_ack())]
    assert alice.frames(2e9 + 1) == [tag(DroneId(1), position(50.0, 8.5, sequence=1))]


def test_a_drone_that_flies_into_the_map_is_noticed_within_a_second() -> None:
    world = HubWorld()
    agent, alice = world.agent(1), world.browser(1)
    agent.send(position(50.0, 8.5))
    world.hub.audience.show_map(alice.browser, HERE)
    assert alice.browser.outbox.far == {DroneId(1)}
    agent.send(position(47.5, 8.5))
    world.hub.each_second(0.0)
    assert alice.browser.outbox.far == set()


def test_a_drone_whose_place_nobody_knows_counts_as_inside() -> None:
    world = HubWorld()
    agent, alice = world.agent(1), world.browser(1)
    world.hub.audience.show_map(alice.browser, HERE)
    assert alice.browser.outbox.far == set()
    agent.send(position(0.0, 0.0))
    world.hub.each_second(0.0)
    assert alice.browser.outbox.far == set()


def test_a_browser_without_a_map_gets_all() -> None:
    world = HubWorld()
    agent, alice = world.agent(1), world.browser(1)
    agent.send(position(50.0, 8.5))
    world.hub.audience.show_map(alice.browser, HERE)
    world.hub.audience.show_map(alice.browser, None)
    world.hub.each_second(0.0)
    assert alice.browser.outbox.far == set()


def test_the_message() -> None:
    text = '{"type":"viewport","bounds":{"south":-1,"west":170.5,"north":1,"east":-170}}'
    shown = decode_request(text)
    assert isinstance(shown, MapShown)
    assert shown.bounds is not None
    assert (shown.bounds.west, shown.bounds.east) == (170.5, -170.0)
    assert decode_request('{"type":"viewport","bounds":null}') == MapShown(None)


@pytest.mark.parametrize(
    "bounds",
    [
        '{"south":2,"west":0,"north":1,"east":1}',
        '{"south":-91,"west":0,"north":1,"east":1}',
        '{"south":0,"west":0,"north":1,"east":181}',
        '{"south":0,"west":0,"north":1}',
        '{"south":0,"west":0,"north":1,"east":NaN}',
        "7",
    ],
)
def test_a_map_that_cannot_be(bounds: str) -> None:
    with pytest.raises(MalformedRequest):
        decode_request(f'{{"type":"viewport","bounds":{bounds}}}')
