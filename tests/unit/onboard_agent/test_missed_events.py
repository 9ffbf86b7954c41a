"""Events that did not arrive are asked for, and the tower gets those that were told before its link."""

import struct
from collections.abc import Iterable

from unit.wire.autopilots.test_event_log import event

from onboard_agent.autopilot.missed_events import (
    AGAIN_S,
    ASK_EVERY_S,
    ASK_TIMES,
    GAP_S,
    KEPT_BY_AUTOPILOT,
    MissedEvents,
)
from onboard_agent.autopilot.own_frames import FrameMaker
from wire.dialect import CRC_EXTRA, CURRENT_EVENT_SEQUENCE, EVENT, EVENT_ERROR, REQUEST_EVENT, decode, mavlink
from wire.frame_stream import FrameStream
from wire.frames import message_id, payload


def told(msgid: int, body: bytes) -> bytes:
    return bytes((0xFD, len(body), 0, 0, 0, 1, 1, msgid & 0xFF, msgid >> 8, 0)) + body + b"\0\0"


def current(sequence: int, *, reset: bool = False) -> bytes:
    return told(CURRENT_EVENT_SEQUENCE, struct.pack("<HB", sequence, reset))


def ranges(frames: Iterable[bytes]) -> list[tuple[int, int]]:
    found = []
    for frame in frames:
        if message_id(frame) == mavlink.MAVLINK_MSG_ID_COMMAND_LONG:
            continue
        assert message_id(frame) == REQUEST_EVENT
        first, last, system, component = struct.unpack("<HHBB", payload(frame).ljust(6, b"\0"))
        assert (system, component) == (1, 1)
        found.append((first, last))
    return found


class Line:
    """Time goes on in steps of 0.1 s."""

    def __init__(self) -> None:
        self.events = MissedEvents(FrameMaker())
        self.now = 100.0

    def hear(self, *sequences: int) -> None:
        for sequence in sequences:
            self.events.receive(EVENT, event(sequence, sequence), self.now)

    def asks(self, for_s: float) -> list[tuple[int, int]]:
        found: list[tuple[int, int]] = []
        for _ in range(round(for_s * 10)):
            self.now += 0.1
            found += ranges(self.events.due(self.now, vehicle_system_id=1))
        return found


def settled(newest: int = 50) -> Line:
    """All of the newest have come, and were asked for again."""
    line = Line()
    line.hear(*range(newest - KEPT_BY_AUTOPILOT + 1, newest + 1))
    assert line.asks(2 * AGAIN_S) == [(newest - KEPT_BY_AUTOPILOT + 1, newest)]
    return line


def test_the_request_is_a_frame_that_others_accept() -> None:
    line = Line()
    line.events.receive(CURRENT_EVENT_SEQUENCE, current(30), line.now)
    (frame,) = line.events.due(line.now + GAP_S, vehicle_system_id=1)
    stream = FrameStream()
    assert (stream.feed(frame), CRC_EXTRA[REQUEST_EVENT]) == ([frame], 33)


def test_nothing_is_asked_of_an_autopilot_without_events() -> None:
    assert Line().asks(30.0) == []


def test_what_the_autopilot_keeps_is_asked_for_when_it_is_first_heard() -> None:
    line = Line()
    line.events.receive(CURRENT_EVENT_SEQUENCE, current(3), line.now)
    assert line.asks(0.5)[:1] == [(65536 + 3 - KEPT_BY_AUTOPILOT + 1, 3)]


def test_a_gap_is_asked_for_until_it_comes() -> None:
    line = settled()
    line.hear(51, 54)
    assert line.asks(GAP_S + ASK_EVERY_S) == [(52, 53)]
    line.hear(52, 53)
    line.asks(AGAIN_S + 1.0)
    assert line.asks(10.0) == []


def test_events_that_follow_at_once_are_no_gap() -> None:
    line = settled()
    line.events.receive(CURRENT_EVENT_SEQUENCE, current(53), line.now)
    line.now += GAP_S / 2
    line.hear(51, 52, 53)
    assert line.asks(AGAIN_S / 2) == []


def test_the_last_ones_are_missed_by_the_sequence_that_is_named() -> None:
    line = settled()
    line.events.receive(CURRENT_EVENT_SEQUENCE, current(52), line.now)
    assert line.asks(GAP_S + 0.1) == [(51, 52)]


def test_it_asks_a_few_times_and_not_for_what_is_gone() -> None:
    line = settled()
    line.events.receive(CURRENT_EVENT_SEQUENCE, current(52), line.now)
    line.events.receive(EVENT_ERROR, told(EVENT_ERROR, struct.pack("<HHBBB", 51, 40, 0, 0, 0)), line.now)
    assert line.asks(20.0) == [(52, 52)] * ASK_TIMES


def test_after_new_ones_all_are_asked_for_once_for_the_tower() -> None:
    line = settled()
    line.hear(51)
    assert line.asks(AGAIN_S - 0.2) == []
    assert line.asks(10.0) == [(51 - KEPT_BY_AUTOPILOT + 1, 51)]


def test_a_new_link_gets_them() -> None:
    line = settled()
    line.events.link_up(line.now)
    assert line.asks(5.0) == [(50 - KEPT_BY_AUTOPILOT + 1, 50)]


def test_an_autopilot_that_restarts_counts_anew() -> None:
    line = settled()
    line.events.receive(CURRENT_EVENT_SEQUENCE, current(2, reset=True), line.now)
    assert line.asks(0.5)[:1] == [(65536 + 2 - KEPT_BY_AUTOPILOT + 1, 2)]
    assert line.events.receive(EVENT, event(2, 1), line.now)


def test_a_heartbeat_is_asked_for_at_once_and_once_for_a_burst() -> None:
    line = settled()
    line.hear(51, 52, 53)
    (ask,) = [decode(one) for one in line.events.due(line.now, vehicle_system_id=1)]
    assert (ask.command, ask.param1) == (mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_HEARTBEAT)
    line.hear(51, 52, 53)
    assert line.events.due(line.now, vehicle_system_id=1) == []
