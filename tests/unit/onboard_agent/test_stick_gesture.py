"""Throttle down and yaw at its end arms and disarms: it does not reach the autopilot, by whatever message it comes."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from onboard_world import World, frame
from pymavlink.dialects.v10 import ardupilotmega as first_version

from onboard_agent.autopilot.stick_gesture import TOLD, TOLD_AFTER_S, without_gesture
from wire.dialect import decode, mavlink
from wire.frame_signing import sign
from wire.frames import checksum_holds

axis = st.integers(-1000, 1000)
pulse = st.one_of(st.integers(800, 2200), st.sampled_from([0, 65535]))


def manual(throttle: int, yaw: int, *, pitch: int = 0, roll: int = 0, buttons: int = 0) -> bytes:
    return frame(mavlink.MAVLink_manual_control_message(1, pitch, roll, throttle, yaw, buttons), system_id=255)


def override(throttle: int, yaw: int) -> bytes:
    return frame(
        mavlink.MAVLink_rc_channels_override_message(1, 1, 1500, 1500, throttle, yaw, 0, 0, 0, 0), system_id=255
    )


@given(pitch=axis, roll=axis, throttle=axis, yaw=axis, buttons=st.integers(0, 65535))
def test_of_manual_control_only_yaw_changes_and_only_in_the_corner(
    pitch: int, roll: int, throttle: int, yaw: int, buttons: int
) -> None:
    sent = manual(throttle, yaw, pitch=pitch, roll=roll, buttons=buttons)
    passed = without_gesture(sent)
    if throttle > 200 or abs(yaw) <= 850:
        assert passed is sent
        return
    before, after = decode(sent), decode(passed)
    assert after is not None and before is not None and checksum_holds(passed)
    assert after.r == (850 if yaw > 0 else -850)
    assert {**after.to_dict(), "r": 0} == {**before.to_dict(), "r": 0}


@given(throttle=pulse, yaw=pulse)
def test_of_overrides_only_yaw_changes_and_only_in_the_corner(throttle: int, yaw: int) -> None:
    sent = override(throttle, yaw)
    passed = without_gesture(sent)
    after = decode(passed)
    assert after is not None and (after.chan1_raw, after.chan3_raw) == (1500, throttle)
    may_be_down = throttle in (0, 65535) or throttle <= 1200
    if yaw in (0, 65535) or not may_be_down:
        assert passed is sent
    else:
        assert abs(after.chan4_raw - 1500) <= 340


def test_old_and_signed_frames_are_guarded_too() -> None:
    packer = first_version.MAVLink(None, srcSystem=255, srcComponent=190)
    old = bytes(first_version.MAVLink_manual_control_message(1, 0, 0, 0, -1000, 0).pack(packer))
    for sent in (old, sign(manual(0, -1000), bytes(32), link_id=0, ticks=1)):
        after = decode(without_gesture(sent))
        assert after is not None and after.r == -850


@pytest.mark.parametrize("kind", ["MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE"])
def test_the_gesture_is_held_back_and_told_once(kind: str) -> None:
    world = World()
    corner = manual(0, -1000) if kind == "MANUAL_CONTROL" else override(1000, 1000)
    said: list[Any] = []
    for _ in range(60):
        world.tower_sends(corner)
        world.pass_time(0.05)
        said += map(decode, world.onboard.frames_to_tower(world.now))
    texts = "".join(one.text for one in said if one is not None and one.get_type() == "STATUSTEXT")
    yaws = {one.r for one in world.messages("MANUAL_CONTROL") if one.r}
    ends = {one.chan4_raw for one in world.messages("RC_CHANNELS_OVERRIDE")}
    assert (yaws, ends) == ({-850}, set()) if kind == "MANUAL_CONTROL" else (set(), {1160})
    assert texts.count(TOLD[:40]) == 1
    assert TOLD_AFTER_S < 1.0, "before any autopilot would have acted"
