"""Who selects the stream profile, when, and the reports on it to the tower."""

from typing import Any

import pytest

from onboard_agent.telemetry.auto_profile import Measured
from onboard_agent.telemetry.telemetry_stream import BY_HAND_FOR_S, SETTLED_AFTER_S, TelemetryStream
from wire.control_messages import StreamSettings, StreamState
from wire.dialect import build, mavlink
from wire.stream_profiles import StreamChoice, StreamProfile

FULL, THIN, MINIMAL = StreamProfile.FULL, StreamProfile.THIN, StreamProfile.MINIMAL


class Bench:
    def __init__(self) -> None:
        self.stream = TelemetryStream()
        self.now = 50.0
        self.stream.link_up(self.now)
        self.reported: list[StreamState] = []
        self.sent = 0

    def run(self, seconds: float, *, loss: float = 0.0, give: Any = None) -> StreamProfile:
        for tick in range(round(seconds / 0.025)):
            self.now += 0.025
            if self.stream.wants_measurement(self.now):
                self.stream.measured(Measured(loss, loss, 0.05), self.now)
            if give is not None and tick % 2 == 0:
                self.sent += len(self.stream.admit([give], self.now))
            self.sent += len(self.stream.due(self.now))
            state = self.stream.changed()
            if state is not None:
                self.reported.append(state)
        return self.stream.profile


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_a_link_is_judged_when_it_has_been_measured_for_a_while(bench: Bench) -> None:
    assert bench.run(SETTLED_AFTER_S, loss=0.5) is FULL
    assert bench.run(2.0, loss=0.5) is MINIMAL
    assert [state.profile for state in bench.reported] == [FULL, MINIMAL]
    assert bench.reported[-1].why == "50% of the packets are lost"


def test_what_is_set_by_hand_wins_and_is_told(bench: Bench) -> None:
    bench.stream.chosen(StreamSettings(profile=StreamChoice.FULL))
    assert bench.run(30, loss=0.5) is FULL
    bench.stream.chosen(StreamSettings(profile=StreamChoice.MINIMAL))
    assert bench.run(60) is MINIMAL
    assert bench.reported[-1] == StreamState(profile=MINIMAL, chosen=StreamChoice.MINIMAL, why="set by an admin")
    bench.stream.chosen(StreamSettings())
    assert bench.run(60) is FULL
    assert bench.reported[-1].chosen is StreamChoice.AUTO


def test_the_way_back_to_auto_begins_where_the_link_is(bench: Bench) -> None:
    bench.stream.chosen(StreamSettings(profile=StreamChoice.FULL))
    bench.run(30, loss=0.15)
    bench.stream.chosen(StreamSettings())
    assert bench.stream.profile is THIN


def test_nothing_is_told_twice_but_all_again_on_a_new_link(bench: Bench) -> None:
    bench.run(10)
    assert len(bench.reported) == 1
    bench.stream.link_down()
    bench.stream.link_up(bench.now)
    bench.stream.resend()
    bench.run(10)
    assert bench.reported[0] == bench.reported[1]
    assert len(bench.reported) == 2


def test_without_a_link_nothing_is_measured_and_the_profile_stays(bench: Bench) -> None:
    bench.run(20, loss=0.15)
    bench.stream.link_down()
    assert bench.run(100, loss=1.0) is THIN
    bench.stream.link_up(bench.now)
    assert bench.run(SETTLED_AFTER_S, loss=1.0) is THIN


def test_a_hand_on_the_sticks_gets_what_it_needs_and_only_so_long(bench: Bench) -> None:
    bench.stream.chosen(StreamSettings(profile=StreamChoice.MINIMAL))
    attitude = build(mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0), system_id=1, component_id=1, sequence=0)
    bench.run(10, give=attitude)
    assert 9 <= bench.sent <= 11
    for _ in range(10):
        bench.stream.sticks_passed(bench.now)
        bench.run(1.0, give=attitude)
    assert 58 <= bench.sent <= 62
    bench.run(BY_HAND_FOR_S, give=attitude)
    before = bench.sent
    bench.run(10, give=attitude)
    assert 9 <= bench.sent - before <= 11
