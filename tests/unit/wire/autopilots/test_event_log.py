"""The newest events of an autopilot, each once."""

import struct

from wire.autopilots.event_log import KEPT, EventLog, ahead, before
from wire.dialect import EVENT


def event(sequence: int, time_ms: int = 0, number: int = 7) -> bytes:
    body = struct.pack("<IIHBBBI", number, time_ms, sequence, 0, 0, 0x33, 5)
    return bytes((0xFD, len(body), 0, 0, 0, 1, 1, EVENT & 0xFF, EVENT >> 8, 0)) + body + b"\0\0"


def test_numbers_go_round() -> None:
    assert (ahead(3, 65530), ahead(65530, 3), ahead(9, 9), before(1, 3)) == (9, -9, 0, 65534)


def test_each_counts_once_and_a_late_one_is_no_newest() -> None:
    log = EventLog()
    taken = [log.take(event(sequence, 10 * index)) for index, sequence in enumerate((65534, 65535, 1))]
    assert (taken, log.newest, 0 in log) == ([True] * 3, 1, False)
    assert (log.take(event(0, 15)), log.take(event(0, 15)), log.newest, 0 in log) == (True, False, 1, True)


def test_it_keeps_the_newest() -> None:
    log = EventLog()
    for sequence in range(KEPT + 5):
        log.take(event(sequence, sequence))
    assert (4 in log, 5 in log, log.newest) == (False, True, KEPT + 4)


def test_an_autopilot_that_counts_anew_is_a_new_log() -> None:
    for again in (event(2, 1, number=9), event(13, 1), event(65000, 1)):
        log = EventLog()
        for sequence in range(10):
            log.take(event(sequence, 1000 + sequence))
        assert log.take(again)
        assert [one for one in range(10) if one in log] == ([2] if 2 in log else [])
