"""A target counts as seen by places on earth alone: a position that is none is no beginning of the way there."""

import pytest

from onboard_agent.transactions.command_seen import _Place
from wire.dialect import mavlink

POSITION = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
LAT_E7, LON_E7 = 473_977_000, 85_456_000


def at(lat_e7: int, lon_e7: int) -> mavlink.MAVLink_message:
    return mavlink.MAVLink_global_position_int_message(0, lat_e7, lon_e7, 0, 0, 0, 0, 0, 0)


@pytest.mark.parametrize("nowhere", [(0, 0), (950_000_000, LON_E7), (2**31 - 1, -(2**31))])
def test_the_first_position_after_none_is_not_nearer(nowhere: tuple[int, int]) -> None:
    seen = _Place(LAT_E7 / 1e7, LON_E7 / 1e7)
    seen.receive(POSITION, at(*nowhere))
    seen.receive(POSITION, at(LAT_E7 + 10_000, LON_E7))
    assert seen.shown is None, "it stands 100 m away"
    seen.receive(POSITION, at(LAT_E7 + 9_000, LON_E7))
    assert seen.shown is True
