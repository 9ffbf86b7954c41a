"""Which of the tower's frames may go to the autopilot, and the reason for each refusal."""

import pytest

from onboard_agent.link.downlink import Downlink
from wire.content import Frames
from wire.dialect import build, mavlink
from wire.drops import DropReason
from wire.ids import DroneId, Epoch

FRAME = build(mavlink.MAVLink_attitude_message(1, 0.1, 0, 0, 0, 0, 0), system_id=255, component_id=190, sequence=0)
SPOILED = FRAME[:-1] + bytes([FRAME[-1] ^ 1])
SETUP = build(mavlink.MAVLink_setup_signing_message(1, 1, [7] * 32, 0), system_id=255, component_id=190, sequence=0)
UNKNOWN = bytes([0xFD, 1, 0, 0, 1, 1, 1, 0x60, 0xEA, 0, 5, 9, 9])


def linked(epoch: int = 5) -> Downlink:
    downlink = Downlink()
    downlink.new_link(DroneId(7), Epoch(epoch))
    return downlink


def frames(*which: bytes, drone_id: int = 7, epoch: int = 5) -> Frames:
    return Frames(DroneId(drone_id), Epoch(epoch), 0, list(which))


@pytest.mark.parametrize(
    ("content", "passed", "reasons"),
    [
        (frames(FRAME, FRAME), [FRAME, FRAME], {}),
        (frames(FRAME, epoch=6), [FRAME], {}),
        (frames(UNKNOWN), [UNKNOWN], {}),
        (frames(FRAME, FRAME, drone_id=8), [], {DropReason.FOREIGN_TAG: 2}),
        (frames(FRAME, drone_id=8, epoch=4), [], {DropReason.FOREIGN_TAG: 1}),
        (frames(FRAME, FRAME, epoch=4), [], {DropReason.STALE_EPOCH: 2}),
        (frames(FRAME, SPOILED, FRAME), [FRAME, FRAME], {DropReason.BAD_FRAME: 1}),
        (frames(SETUP, FRAME), [FRAME], {"setup_signing": 1}),
    ],
)
def test_what_passes(content: Frames, passed: list[bytes], reasons: dict[str, int]) -> None:
    downlink = linked()
    assert downlink.admit(content) == passed
    assert downlink.counts == reasons


def test_a_foreign_datagram_does_not_raise_the_epoch() -> None:
    downlink = linked()
    downlink.admit(frames(FRAME, drone_id=8, epoch=99))
    assert downlink.epoch == 5


def test_the_epoch_only_grows_while_a_link_lives() -> None:
    downlink = linked()
    downlink.raise_epoch(9)
    downlink.raise_epoch(3)
    assert downlink.admit(frames(FRAME, epoch=8)) == []
    assert downlink.admit(frames(FRAME, epoch=10)) == [FRAME]
    assert downlink.admit(frames(FRAME, epoch=9)) == []


def test_a_new_link_states_the_epoch() -> None:
    downlink = linked(9)
    downlink.new_link(DroneId(7), Epoch(2))
    assert downlink.admit(frames(FRAME, epoch=2)) == [FRAME]
