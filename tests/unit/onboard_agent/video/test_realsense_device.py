"""A RealSense device shared by sources: restarts, silence, modes; and depth in millimetres."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pytest

from onboard_agent.video.sources import realsense_device
from onboard_agent.video.sources.depth import metres, to_millimetres
from onboard_agent.video.sources.mode import Mode
from onboard_agent.video.sources.realsense_device import Failed, RealsenseDevice, Seat
from onboard_agent.video.sources.realsense_streams import Stream

DEADLINE_S = 30.0
VGA, WIDE = Mode(640, 480, 30), Mode(848, 480, 30)


class FakeFrame:
    def __init__(self, number: int) -> None:
        self.number = number

    def get_frame_number(self) -> int:
        return self.number


class FakePipeline:
    """Gives what the world says, at most a set of frames every millisecond."""

    def __init__(self, world: World, modes: Mapping[Stream, Mode]) -> None:
        self.world = world
        world.starts.append(dict(modes))
        if world.refuses:
            raise RuntimeError(world.refuses)

    def frames(self, timeout_ms: int, *, is_aligned: bool) -> Mapping[Stream, Any] | None:
        time.sleep(0.001)
        self.world.number += 1
        streams = {*self.world.starts[-1], *([Stream.ALIGNED] if is_aligned else [])} - self.world.silent
        return {stream: FakeFrame(self.world.repeats.get(stream, self.world.number)) for stream in streams}

    def stop(self) -> None:
        self.world.stops += 1


class World:
    def __init__(self) -> None:
        self.starts: list[dict[Stream, Mode]] = []
        self.stops = self.number = 0
        self.refuses = ""
        self.silent: set[Stream] = set()
        self.repeats: dict[Stream, int] = {}
        self.device = RealsenseDevice(lambda modes: FakePipeline(self, modes))
        self.tickets: list[object] = []

    def join(self, stream: Stream, mode: Mode = Mode()) -> object:  # noqa: B008 - a value
        self.tickets.append(self.device.join(Seat(stream, mode)))
        return self.tickets[-1]

    def frame(self, ticket: object) -> int:
        frame = self.device.take(ticket, DEADLINE_S)
        assert frame is not None
        return int(frame.number)

    def failure(self, ticket: object) -> str:
        deadline = time.monotonic() + DEADLINE_S
        with pytest.raises(Failed) as found:
            while time.monotonic() < deadline:
                self.device.take(ticket, 0.1)
        return str(found.value)


@pytest.fixture
def world(monkeypatch: pytest.MonkeyPatch) -> Iterator[World]:
    monkeypatch.setattr(realsense_device, "JOIN_S", 0.01)
    made = World()
    yield made
    for ticket in made.tickets:
        made.device.leave(ticket)
    assert not [one for one in threading.enumerate() if one.name == "realsense"]
    assert made.stops == len(made.starts) - bool(made.refuses)


def test_a_stream_that_joins_restarts_with_all_and_one_that_leaves_does_not(world: World) -> None:
    depth = world.join(Stream.DEPTH, WIDE)
    world.frame(depth)
    aligned = world.join(Stream.ALIGNED)
    world.frame(aligned)
    assert world.starts == [{Stream.DEPTH: WIDE}, {Stream.DEPTH: WIDE, Stream.COLOUR: Mode()}]
    colour = world.join(Stream.COLOUR)
    world.frame(colour)
    world.device.leave(aligned)
    assert world.frame(depth) < world.frame(depth)
    world.frame(colour)
    assert len(world.starts) == 2
    for ticket in (depth, colour):
        world.device.leave(ticket)
    assert world.stops == 2


def test_it_is_opened_again_after_the_last_has_left(world: World) -> None:
    for _ in range(3):
        ticket = world.join(Stream.COLOUR)
        world.frame(ticket)
        world.device.leave(ticket)
    assert (len(world.starts), world.stops) == (3, 3)


def test_a_frame_that_nobody_fetched_is_replaced(world: World) -> None:
    depth, colour = world.join(Stream.DEPTH), world.join(Stream.COLOUR)
    number = world.frame(depth)
    while world.frame(colour) < number + 20:
        pass
    assert world.frame(depth) >= number + 20


def test_a_frame_that_the_pipeline_repeats_counts_once(world: World) -> None:
    world.repeats[Stream.INFRARED] = 7
    infrared = world.join(Stream.INFRARED)
    assert world.frame(infrared) == 7
    assert world.device.take(infrared, 0.05) is None


def test_a_stream_in_two_modes_is_refused(world: World) -> None:
    world.frame(world.join(Stream.DEPTH, VGA))
    with pytest.raises(Failed, match="its stream depth is read in another size or rate already"):
        world.join(Stream.ALIGNED, WIDE)
    world.frame(world.join(Stream.ALIGNED))


def test_one_silent_stream_ends_all_with_words(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(realsense_device, "READ_PATIENCE_S", 0.05)
    monkeypatch.setattr(realsense_device, "OPEN_PATIENCE_S", 0.05)
    world.silent = {Stream.COLOUR}
    depth, colour = world.join(Stream.DEPTH), world.join(Stream.COLOUR)
    assert world.failure(depth) == world.failure(colour) == "its stream colour gives no pictures"


def test_what_the_library_says_of_the_start_is_said(world: World) -> None:
    world.refuses = "No device connected"
    assert world.failure(world.join(Stream.DEPTH)) == "No device connected"


def test_depth_is_in_millimetres_whatever_the_camera_counts() -> None:
    counts = np.array([[0, 1, 3, 20_000, 65_535]], np.uint16)
    assert to_millimetres(counts, 0.001) is counts
    assert to_millimetres(counts, 0.0001).tolist() == [[0, 1, 1, 2000, 6554]]  # known stays known
    assert to_millimetres(counts, 0.002).tolist() == [[0, 2, 6, 40_000, 0]]  # beyond 65.535 m is unknown
    found = metres(np.array([[0, 1500]], np.uint16))
    assert np.isnan(found[0, 0])
    assert found[0, 1] == pytest.approx(1.5)
