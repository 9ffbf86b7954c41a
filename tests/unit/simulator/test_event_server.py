"""The simulated PX4 numbers its events and sends them again; an agent behind a lossy line gets its whole report."""

import random

import pytest

from onboard_agent.autopilot.missed_events import MissedEvents
from onboard_agent.autopilot.own_frames import FrameMaker
from simulator.dialect import Codec, Message
from simulator.event_server import FIRST, KEPT, NAMED_EVERY_S, EventServer
from simulator.px4.events import check_report
from wire.autopilots.event_log import read_event
from wire.autopilots.px4_checks import Px4Checks
from wire.dialect import CURRENT_EVENT_SEQUENCE, EVENT, EVENT_ERROR
from wire.frame_stream import FrameStream
from wire.frames import message_id, payload

LOITER = 4 << 16 | 3 << 24


class Line:
    """Between the events of a vehicle and a tower's checks, by way of an agent. `loses`: the share of frames."""

    def __init__(self, loses: float, seed: int = 1) -> None:
        self.codec, self.stream = Codec(1), FrameStream()
        self.server = EventServer(self.sent)
        self.agent, self.checks = MissedEvents(FrameMaker()), Px4Checks()
        self.frames: list[bytes] = []
        self.now = 0.0
        self._loses, self._random = loses, random.Random(seed)

    def sent(self, message: Message) -> None:
        (frame,) = self.stream.feed(self.codec.encode(message))
        self.frames.append(frame)
        if self._random.random() < self._loses:
            return
        self.agent.receive(message_id(frame), frame, self.now)
        if message_id(frame) == EVENT and self._random.random() >= self._loses:
            self.checks.take(frame)

    def wait(self, seconds: float) -> None:
        for _ in range(round(seconds * 20)):
            self.now += 0.05
            self.server.update(self.now)
            for frame in self.agent.due(self.now, vehicle_system_id=1):
                (request,) = self.codec.decode(frame)
                if request.get_type() != "REQUEST_EVENT":
                    continue
                self.server.asked(request, (request.get_srcSystem(), request.get_srcComponent()))

    def report(self, failing: str | None) -> None:
        for event in check_report(failing):
            self.server.tell(event, self.now)


def test_it_names_and_numbers_them() -> None:
    line = Line(0.0)
    line.report("check_battery_low")
    kinds = [message_id(frame) for frame in line.frames]
    assert kinds == [CURRENT_EVENT_SEQUENCE, EVENT, EVENT, EVENT]
    assert payload(line.frames[0]) == bytes((FIRST & 0xFF, FIRST >> 8, 1))
    assert [read_event(frame)[0] for frame in line.frames[1:]] == [FIRST, FIRST + 1, FIRST + 2]
    line.frames.clear()
    line.server.update(NAMED_EVERY_S + 0.1)
    assert [message_id(frame) for frame in line.frames] == [CURRENT_EVENT_SEQUENCE]


def test_it_says_what_it_keeps_no_more() -> None:
    line = Line(1.0)  # the agent hears nothing, and asks nothing
    for _ in range(KEPT):
        line.report(None)
    line.frames.clear()
    line.agent = MissedEvents(FrameMaker())
    frame = MissedEvents(FrameMaker())._request(FIRST, FIRST + 1, 1)
    (request,) = line.codec.decode(frame)
    line.server.asked(request, (1, 191))
    assert [message_id(one) for one in line.frames] == [EVENT_ERROR, EVENT_ERROR]


@pytest.mark.parametrize("seed", range(20))
def test_a_lossy_line_leaves_no_reason_unread(seed: int) -> None:
    line = Line(0.1, seed)
    for failing, reasons in (
        ("check_battery_low", ("the battery is low",)),
        (None, ()),
        ("check_system_no_home_pos", ("home is not set",)),
    ):
        line.report(failing)
        line.wait(20.0)
        for _ in range(3):  # as at each new link to a tower
            line.agent.link_up(line.now)
            line.wait(2.0)
        assert line.checks.reasons(LOITER) == reasons


def test_a_tower_that_comes_later_gets_the_report() -> None:
    line = Line(0.0)
    line.report("check_battery_low")
    line.wait(10.0)
    line.checks = Px4Checks()
    line.agent.link_up(line.now)
    line.wait(1.0)
    assert line.checks.reasons(LOITER) == ("the battery is low",)
