"""Which frames belong to a flight of the black box."""

from frames_of_flight import attitude, signing

from onboard_agent.black_box.tape import AFTER_S, BEFORE_S, CHUNK_S, MAX_RING_BYTES, MAX_SILENT_S, BlackBoxTape
from wire.frames import frame_length

WALL_US = 1_800_000_000_000_000


class Sink:
    def __init__(self) -> None:
        self.flights: list[bytearray] = []
        self.ended: list[int] = []

    def begin(self, at_us: int) -> None:
        self.flights.append(bytearray())

    def frames(self, chunk: bytes, last_us: int) -> None:
        self.flights[-1] += chunk

    def end(self, at_us: int) -> None:
        self.ended.append(at_us)


class Flown:
    """A tape and a clock. `step_us`: what was added to the time of day."""

    def __init__(self) -> None:
        self.now = 100.0
        self.step_us = 0
        self.sink = Sink()
        self.tape = BlackBoxTape(self.sink, lambda: WALL_US + int(self.now * 1e6) + self.step_us, self.now)
        self.number = 0

    def run(self, seconds: float, *, armed: bool, heard: bool = True) -> None:
        for _ in range(round(seconds / 0.1)):
            self.now += 0.1
            if heard:
                self.number += 1
                self.tape.add([attitude(self.number)], self.now)
            self.tape.tick(self.now, armed=armed, heard=heard)


def count(flight: bytearray) -> int:
    at = frames = 0
    while at < len(flight):
        at += 8 + frame_length(bytes(flight[at + 8 : at + 11]))
        frames += 1
    return frames


def test_a_flight_has_what_came_before_arming_and_after_disarming() -> None:
    flown = Flown()
    flown.run(60.0, armed=False)
    flown.run(20.0, armed=True)
    flown.run(AFTER_S + 1.0, armed=False)

    (flight,) = flown.sink.flights
    assert len(flown.sink.ended) == 1
    expected = 10 * (BEFORE_S + 20.0 + AFTER_S)
    assert expected - 60 <= count(flight) <= expected + 55, "chunks of 5 s are kept or dropped as wholes"


def test_every_frame_of_a_flight_reaches_the_disk_within_a_chunk() -> None:
    flown = Flown()
    flown.run(5.0, armed=True)
    assert flown.number - count(flown.sink.flights[0]) <= 10 * CHUNK_S + 1


def test_a_key_is_never_written() -> None:
    flown = Flown()
    flown.tape.tick(flown.now, armed=True, heard=True)
    flown.tape.add([attitude(1), signing(), attitude(2)], flown.now)
    flown.tape.stop(flown.now)
    assert count(flown.sink.flights[0]) == 2
    assert b"k" * 32 not in flown.sink.flights[0]


def test_a_silent_autopilot_ends_no_flight_for_half_an_hour() -> None:
    flown = Flown()
    flown.run(2.0, armed=True)
    flown.run(MAX_SILENT_S - 10.0, armed=True, heard=False)
    assert flown.tape.recording
    flown.run(20.0, armed=True, heard=False)
    assert not flown.tape.recording


def test_arming_again_begins_another_flight() -> None:
    flown = Flown()
    flown.run(2.0, armed=True)
    flown.run(2.0, armed=False)
    flown.run(2.0, armed=True)
    assert len(flown.sink.flights) == 2


def test_setting_the_time_of_day_moves_nothing_within_a_flight() -> None:
    flown = Flown()
    flown.run(2.0, armed=True)
    flown.step_us = 3_600_000_000
    flown.run(2.0, armed=True)
    assert abs(flown.tape.now_us(flown.now) - WALL_US - flown.now * 1e6) < 1e3


def test_a_clock_set_on_the_ground_spoils_no_flight() -> None:
    flown = Flown()
    flown.run(20.0, armed=False)
    flown.step_us = 3_600_000_000
    flown.run(2.0, armed=True)
    (flight,) = flown.sink.flights
    assert int.from_bytes(flight[:8]) > WALL_US + 3_600_000_000, "what came before has times that do not fit"


def test_what_came_before_is_bounded() -> None:
    flown = Flown()
    for _ in range(100):
        flown.now += 0.2
        flown.tape.add([attitude(1)] * 400, flown.now)
        flown.tape.tick(flown.now, armed=False, heard=True)
    flown.tape.tick(flown.now, armed=True, heard=True)
    assert 0 < len(flown.sink.flights[0]) <= MAX_RING_BYTES
