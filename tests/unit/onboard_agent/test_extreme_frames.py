"""Whatever its autopilot sends, the agent goes on, and the tower can read each message that the agent makes of it."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st
from onboard_world import World
from worlds.extreme_frames import extreme_frames
from worlds.tiers import examples

from wire.control_messages import decode_to_tower, encode_message
from wire.dialect import mavlink

EVERY_MESSAGE = sorted(mavlink.mavlink_map)
_READ = (
    "HEARTBEAT GLOBAL_POSITION_INT HOME_POSITION ATTITUDE SYS_STATUS EKF_STATUS_REPORT ESTIMATOR_STATUS "
    "EXTENDED_SYS_STATE RC_CHANNELS PARAM_VALUE AUTOPILOT_VERSION COMMAND_ACK STATUSTEXT MISSION_COUNT "
    "MISSION_CURRENT MISSION_ITEM_INT TIMESYNC FILE_TRANSFER_PROTOCOL LOG_ENTRY BATTERY_STATUS"
)
READ = [int(getattr(mavlink, f"MAVLINK_MSG_ID_{name}")) for name in _READ.split()]


@given(
    st.lists(
        st.one_of(extreme_frames(st.sampled_from(READ)), extreme_frames(st.sampled_from(EVERY_MESSAGE))),
        max_size=10,
    )
)
@settings(max_examples=examples(40, long=1000), deadline=None)
def test_an_autopilot_with_impossible_values_costs_no_message(frames: list[bytes]) -> None:
    world = World()
    for frame in frames:
        world.onboard.from_autopilot([frame], world.now)
        world.pass_time(0.3)
    world.pass_time(0.5)
    assert world.reported
    for message in world.reported:
        decode_to_tower(encode_message(message))
