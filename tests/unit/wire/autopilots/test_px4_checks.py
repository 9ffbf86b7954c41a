"""PX4's arming checks, from its events."""

import itertools
import struct

from wire.autopilots.px4_checks import Px4Checks
from wire.autopilots.px4_events import event_id
from wire.dialect import EVENT

LOITER, MISSION, OFFBOARD = 4 << 16 | 3 << 24, 4 << 16 | 4 << 24, 6 << 16
REAL = (
    "e093a801f49b01003400000088000000100000000000f7bf7f80f7bf7f80",
    "d9c20501f49b010035000000660800000014",
    "c71d2f01f49b010036000000330040000014",
    "27371d01f49b01003700000088000a1c0238",
)
"""Payloads of PX4 1.16 in its own simulator, ready to arm."""


def frame(message: bytes) -> bytes:
    return bytes((0xFD, len(message), 0, 0, 0, 1, 1, EVENT & 0xFF, EVENT >> 8, 0)) + message + b"\0\0"


SEQUENCE = itertools.count(1)


def event(name: str, modes: int = 0) -> bytes:
    sequence = next(SEQUENCE)
    message = struct.pack("<IIHBBBI", event_id(name), sequence, sequence, 0, 0, 0x33, modes)
    return frame(message.rstrip(b"\0"))


def report(*failing: tuple[str, int]) -> list[bytes]:
    parts = (("commander_arming_check_summary", 0), *failing, ("commander_health_summary", 0))
    return [event(name, modes) for name, modes in parts]


def told(frames: list[bytes]) -> Px4Checks:
    checks = Px4Checks()
    for one in frames:
        checks.take(one)
    return checks


def test_what_a_real_one_tells() -> None:
    checks = told([frame(bytes.fromhex(one)) for one in REAL])
    assert checks.reasons(LOITER) == ()
    assert checks.reasons(MISSION) == ("no mission is on board",)
    assert checks.reasons(OFFBOARD) == ("no set-points arrive for this mode",)
    assert checks.fence_breach == ""


def test_a_report_counts_as_a_whole_and_replaces_the_one_before() -> None:
    checks = Px4Checks()
    assert checks.fence_breach is None
    first = report(("check_modes_global_pos", 0xFFFFFFFF), ("check_gf_violation_max_alt", 0xFFFFFFFF))
    for one in first[:-1]:
        checks.take(one)
    assert checks.reasons(LOITER) == ()
    checks.take(first[-1])
    assert checks.reasons(LOITER) == ("it has no global position", "it is outside its fence")
    assert checks.fence_breach == "its maximum height"
    for one in report():
        checks.take(one)
    assert (checks.reasons(LOITER), checks.fence_breach) == ((), "")


def test_an_event_outside_a_report_an_unknown_one_and_an_unknown_mode_tell_nothing() -> None:
    checks = told([event("check_modes_global_pos", 0xFFFFFFFF), *report(("check_of_next_year", 0xFFFFFFFF))])
    assert checks.reasons(LOITER) == ()
    assert told(report(("check_modes_mission", 0xFFFFFFFF))).reasons(99 << 16) == ()


def test_a_report_with_a_missed_event_counts_when_it_comes() -> None:
    whole = report(("check_modes_home_position", 0xFFFFFFFF))
    checks = told(whole)
    first, missed, last = report(("check_battery_low", 0xFFFFFFFF))
    for one in (first, last):
        checks.take(one)
    assert checks.reasons(LOITER) == ("home is not set",)
    assert (checks.take(missed), checks.take(missed)) == (True, False)
    assert checks.reasons(LOITER) == ("the battery is low",)
    for one in whole:
        assert not checks.take(one), "an old report that comes again"
    assert checks.reasons(LOITER) == ("the battery is low",)


def test_a_report_that_lost_its_end_is_not_mixed_with_the_next() -> None:
    checks = told(report(("check_battery_low", 0xFFFFFFFF))[:-1])
    begins, *_, ends = report()
    for one in (begins, ends):
        checks.take(one)
    assert checks.reasons(LOITER) == ()
