"""The autopilot's own failsafe: shown by its heartbeat, explained by an event."""

import struct
from typing import Any

import pytest

from onboard_agent.autopilot.own_failsafe import SAME_WITHIN_S, OwnFailsafe
from wire.autopilots.failsafe_words import NOT_TOLD, Failsafe, FailsafeAction, FailsafeCause
from wire.autopilots.px4_events import event_id, read_failsafe
from wire.dialect import EVENT, mavlink

PX4, ARDUPILOT = mavlink.MAV_AUTOPILOT_PX4, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
ACTIVE, CRITICAL = mavlink.MAV_STATE_ACTIVE, mavlink.MAV_STATE_CRITICAL


def event(name: str, layout: str, *arguments: int) -> bytes:
    packed = struct.pack("<IIHBBB", event_id(name), 5000, 7, 0, 0, 0x24) + struct.pack(layout, *arguments)
    message = packed.rstrip(b"\0")
    return bytes((0xFD, len(message), 0, 0, 0, 1, 1, EVENT & 0xFF, EVENT >> 8, 0)) + message + b"\0\0"


def beat(status: int = CRITICAL, *, autopilot: int = PX4, armed: bool = True) -> Any:
    return mavlink.MAVLink_heartbeat_message(2, autopilot, 0x80 if armed else 0, 0, status, 3)


STICKS_LOST = event("commander_failsafe_enter_hold", "<IBHB", 3 << 16, 6, 5, 1)


@pytest.mark.parametrize(
    ("frame", "words"),
    [
        (STICKS_LOST, "its failsafe holds, and returns in 5 s: no sticks arrive"),
        (event("commander_failsafe_enter", "<IBB", 0, 7, 2), "its failsafe lands: no ground station is heard"),
        (event("commander_failsafe_enter_generic", "<IB", 0, 6), "its failsafe returns"),
        (event("commander_failsafe_enter_generic_hold", "<IBH", 0, 7, 3), "its failsafe holds, and lands in 3 s"),
        (
            event("commander_failsafe_enter_crit_bat_warn", "<"),
            "its failsafe warns only: the battery is critically low",
        ),
        (event("commander_failsafe_enter_warn", "<IB", 0, 1), "its failsafe warns only: no sticks arrive"),
    ],
)
def test_an_event_in_words(frame: bytes, words: str) -> None:
    told = read_failsafe(frame)
    assert told is not None
    assert told.words == words


def test_other_events_and_unknown_numbers_are_no_failsafe() -> None:
    assert read_failsafe(event("commander_rc_override", "<")) is None
    assert read_failsafe(event("commander_failsafe_enter", "<IBB", 0, 99, 1)) is None


def test_the_mode_is_the_failsafes_while_px4_is_critical_and_armed() -> None:
    failsafe = OwnFailsafe()
    for status, autopilot, armed, active in (
        (CRITICAL, PX4, True, True),
        (ACTIVE, PX4, True, False),
        (CRITICAL, PX4, False, False),
        (CRITICAL, ARDUPILOT, True, False),
    ):
        failsafe.heartbeat(beat(status, autopilot=autopilot, armed=armed), 1.0)
        assert failsafe.active is active


def test_the_event_before_the_heartbeat_is_the_reason_and_an_old_one_is_not() -> None:
    failsafe = OwnFailsafe()
    failsafe.event(STICKS_LOST, 0.5)
    failsafe.heartbeat(beat(ACTIVE), 0.9)
    failsafe.event(STICKS_LOST, 1.0)
    assert (failsafe.misses_sticks, failsafe.words) == (False, "")
    failsafe.heartbeat(beat(), 1.9)
    assert failsafe.misses_sticks
    assert failsafe.words == Failsafe(FailsafeCause.MANUAL_CONTROL_LOSS, FailsafeAction.RETURN, 5.0).words
    failsafe.heartbeat(beat(ACTIVE), 2.9)
    failsafe.heartbeat(beat(), 1.0 + SAME_WITHIN_S + 1.0)
    assert (failsafe.misses_sticks, failsafe.words) == (False, NOT_TOLD)


def test_a_reason_that_comes_later_counts_as_well() -> None:
    failsafe = OwnFailsafe()
    failsafe.heartbeat(beat(), 1.0)
    assert failsafe.words == NOT_TOLD
    failsafe.event(STICKS_LOST, 1.1)
    assert failsafe.misses_sticks
