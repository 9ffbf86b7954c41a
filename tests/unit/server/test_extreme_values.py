"""Whatever a vehicle sends, its link lives, and all that the tower makes of it can be read by the other side."""

from __future__ import annotations

from hub_world import HubWorld, record
from hypothesis import example, given, settings
from hypothesis import strategies as st
from test_zones_on_board import square
from worlds.extreme_frames import extreme_frames, frame_of
from worlds.tiers import examples

from server.live.live_messages import encode_event
from wire.control_messages import decode_to_agent, encode_message
from wire.dialect import mavlink
from wire.ids import DroneId
from wire.zones.nearby import ZONES

EVERY_MESSAGE = sorted(set(mavlink.mavlink_map) - {mavlink.MAVLINK_MSG_ID_SETUP_SIGNING})
_READ = (
    "GLOBAL_POSITION_INT HOME_POSITION HEARTBEAT SYS_STATUS BATTERY_STATUS ATTITUDE GPS_RAW_INT GPS2_RAW VFR_HUD "
    "EKF_STATUS_REPORT STATUSTEXT ADSB_VEHICLE COLLISION OPEN_DRONE_ID_LOCATION OPEN_DRONE_ID_BASIC_ID"
)
READ = [int(getattr(mavlink, f"MAVLINK_MSG_ID_{name}")) for name in _READ.split()]
NORTH_OF_THE_POLE = frame_of(
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
    bytes(4) + (950_000_000).to_bytes(4, "little") + (85_456_000).to_bytes(4, "little") + bytes(16),
)


@given(
    st.lists(
        st.one_of(extreme_frames(st.sampled_from(READ)), extreme_frames(st.sampled_from(EVERY_MESSAGE))), max_size=12
    )
)
@settings(max_examples=examples(60, long=1500), deadline=None)
@example([NORTH_OF_THE_POLE])
def test_a_vehicle_with_impossible_values_keeps_its_link(frames: list[bytes]) -> None:
    world = HubWorld(height_limit_m=120.0)
    world.apply(record(1, (1,), holder=1), record(2, (1,)))
    world.hub.zones.replace([square(100.0)])
    agent, neighbour, browser = world.agent(1, takes=(ZONES,)), world.agent(2, takes=(ZONES,)), world.browser(1)
    for drone_id in (1, 2):
        drone = world.hub.state.drones[DroneId(drone_id)]
        drone.armed = drone.airborne = drone.was_airborne = True
    now = 1.0
    for frame in frames:
        now += 1.1
        agent.send(frame, now=now)
        neighbour.send(frame, now=now)
        world.hub.tick(now)
    for one in (agent, neighbour):
        assert one.closed == []
        for message in one.posted:
            assert decode_to_agent(encode_message(message)) == message
    for event in browser.events():
        assert encode_event(event)
