"""Video of a whole agent: its own process for the pictures, and a flight that does not notice it."""

import asyncio
import os
import signal
import threading
import time
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pytest
from agent_fakes import FakeAutopilot, running_agent, running_autopilot, until
from video_tower import TICKET, MjpegCamera, VideoTower, video_tower, write_film

from onboard_agent.agent import Agent
from onboard_agent.autopilot_port.udp import UdpIn
from onboard_agent.video.core.service import SILENT_WORDS, STOPPED_WORDS
from wire.dialect import mavlink
from wire.video import VIDEO, CameraState, ClockAnswer, ClockProbe, Codec, Quality, StreamRequest, Unit

LOW, MEDIUM, HIGH = (StreamRequest(quality, Codec.MPEG1) for quality in Quality)
MEDIUM_H264 = StreamRequest(Quality.MEDIUM, Codec.H264)


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("film") / "film.mp4"
    write_film(str(path))
    return f"file:{path}"


@dataclass
class Scene:
    tower: VideoTower
    agent: Agent
    autopilot: FakeAutopilot

    @property
    def pid(self) -> int:
        """Of the video process."""
        pid = self.agent._video_child.pid
        assert pid is not None
        return pid

    @property
    def runs(self) -> bool:
        return self.agent._video_child.pid is not None


@asynccontextmanager
async def scene(camera: str) -> AsyncIterator[Scene]:
    async with AsyncExitStack() as stack:
        tower = await stack.enter_async_context(video_tower())
        port = UdpIn("udpin:127.0.0.1:0", "127.0.0.1", 0)
        agent = await stack.enter_async_context(running_agent(tower, port, camera))
        await until(lambda: port.bound_port, what="the port is open")
        autopilot = await stack.enter_async_context(running_autopilot(port.bound_port))
        await tower.linked()
        await until(lambda: tower.frames, what="telemetry")
        yield Scene(tower, agent, autopilot)


class MachinePauses:
    """For how long a busy machine let nobody of us run, all together: in a thread, so that a loop that is held up does
    not count."""

    def __enter__(self) -> "MachinePauses":
        self.total_s = 0.0
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._look, daemon=True)
        self._thread.start()
        return self

    def _look(self) -> None:
        before = time.monotonic()
        while not self._end.wait(0.01):
            now = time.monotonic()
            if now - before > 0.05:
                self.total_s += now - before
            before = now

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()


@asynccontextmanager
async def flight_notices_nothing(scene: Scene) -> AsyncIterator[None]:
    """Frames of the autopilot reach the tower all the while, none of them late, over the same link."""
    took_s: list[float] = []
    hellos = len(scene.tower.hellos)

    async def look() -> None:
        while True:
            before = len(scene.tower.frames)
            sent_at = time.monotonic()
            scene.autopilot.say(mavlink.MAVLink_statustext_message(6, b"all well"))  # urgent: sent at once
            await until(lambda: len(scene.tower.frames) > before, 5.0, "a frame")  # noqa: B023
            took_s.append(time.monotonic() - sent_at)
            await asyncio.sleep(0.02)

    with MachinePauses() as pauses:
        looking = asyncio.create_task(look())
        try:
            yield
            await until(lambda: len(took_s) > 20, what="more frames")
        finally:
            looking.cancel()
            await asyncio.gather(looking, return_exceptions=True)
    assert max(took_s) < 0.5 + pauses.total_s, "the flight loop was held up"
    assert scene.agent._link.up
    assert len(scene.tower.hellos) == hellos, "the link was lost"


def exists(pid: int) -> bool:
    return Path(f"/proc/{pid}").exists()


def in_order(units: list[Unit]) -> bool:
    return [unit.sequence for unit in units] == list(range(units[0].sequence, units[0].sequence + len(units)))


async def test_pictures_come_while_somebody_watches_and_the_process_is_behind_the_flight(film: str) -> None:
    async with scene(film) as there:
        assert VIDEO in there.tower.hellos[0].takes
        await there.tower.camera_is(CameraState.IDLE)
        assert not there.runs, "nobody watches"
        await there.tower.watch(MEDIUM)
        units = await there.tower.more(MEDIUM, 60)
        assert units[0].key
        assert not units[0].sequence
        assert in_order(units)
        assert 1 < sum(unit.key for unit in units) < 12
        assert all(unit.payload[:1] == b"\x47" and not len(unit.payload) % 188 for unit in units), "MPEG-TS"
        assert {(unit.width, unit.height) for unit in units} == {(320, 240)}
        now_us = time.monotonic_ns() // 1000
        assert all(now_us - 5_000_000 < unit.capture_us < now_us for unit in units[-10:])
        state = await there.tower.camera_is(CameraState.LIVE)
        assert set(state.codecs) == {Codec.MPEG1, Codec.H264}
        assert os.getpriority(os.PRIO_PROCESS, there.pid) == max(5, os.getpriority(os.PRIO_PROCESS, 0))
        await there.tower.watch(MEDIUM, LOW)
        low = await there.tower.more(LOW, 5)
        assert low[0].key
        await there.tower.watch(MEDIUM_H264)
        h264 = await there.tower.more(MEDIUM_H264, 5)
        assert h264[0].key
        assert h264[0].payload[:3] in (b"\x00\x00\x01", b"\x00\x00\x00"), "Annex B"
        await there.tower.watch()
        await there.tower.camera_is(CameraState.IDLE)
        quiet_from = len(there.tower.units)
        await asyncio.sleep(0.5)
        assert len(there.tower.units) <= quiet_from + 2
        assert there.runs, "the next viewer need not wait for it"


async def test_another_quality_comes_and_goes_and_the_first_goes_on() -> None:
    camera = MjpegCamera()
    await camera.plug_in()
    async with scene(f"http://127.0.0.1:{camera.port}/camera") as there:
        await there.tower.watch(LOW)
        await there.tower.more(LOW, 24)
        for is_last in (False, False, True):
            opened, channels, since = camera.opened, len(there.tower.channels), time.monotonic()
            for others in ((HIGH,), (HIGH, MEDIUM_H264), (MEDIUM,), ()):
                await there.tower.watch(LOW, *others)
                for other in others:
                    assert (await there.tower.more(other, 10))[0].key or there.tower.of(other, since)[0].key
                await there.tower.more(LOW, 12)
            units = there.tower.of(LOW, since)
            assert in_order(units)
            pauses = sorted((after.capture_us - before.capture_us) / 1e6 for before, after in pairwise(units))
            if (pauses[-1] < 1.0 and pauses[len(pauses) // 2] < 0.12) or is_last:
                break
            # The machine stood still, or a viewer saw it stand still: with another quality that happens each time.
        assert not any(unit.is_break for unit in units), "it began anew"
        assert camera.opened == opened, "the camera was opened again"
        assert len(there.tower.channels) == channels, "the channel was opened again"
        assert pauses[len(pauses) // 2] < 0.12, "twelve in a second"
        assert pauses[-1] < 1.0, "a viewer sees it stand still"
        await camera.unplug()


async def test_what_the_link_carried_is_remembered_by_the_next_process_but_not_for_the_next_link(film: str) -> None:
    async with scene(film) as there:
        await there.tower.watch(MEDIUM)
        await there.tower.more(MEDIUM, 60)
        service = there.agent._video
        learnt = await until(lambda: service.link, what="what the link carries")
        assert learnt.local == "127.0.0.1"
        gone = there.pid
        os.kill(gone, signal.SIGKILL)
        await until(lambda: there.runs and there.pid != gone, what="another process")
        kept = service.link
        assert kept is not None
        await until(lambda: service.link != kept, what="it has learnt more")
        assert service.link is not None, "it was told"
        assert there.tower.connection is not None
        await there.tower.connection.close(4000, "another link")
        await there.tower.linked(2)
        assert service.link is None
        await there.tower.watch(MEDIUM)
        await there.tower.more(MEDIUM, 3)


@pytest.mark.parametrize(
    ("number", "first_words"),
    [
        (signal.SIGKILL, (STOPPED_WORDS,)),
        (signal.SIGSEGV, (STOPPED_WORDS, SILENT_WORDS)),  # silent while the system writes its memory down
        (signal.SIGSTOP, (SILENT_WORDS,)),
    ],
    ids=["killed", "crashed", "stopped"],
)
async def test_a_video_process_that_ends_or_stops_is_said_and_replaced_and_flight_notices_nothing(
    film: str, number: int, first_words: tuple[str, ...]
) -> None:
    async with scene(film) as there:
        await there.tower.watch(MEDIUM)
        await there.tower.more(MEDIUM, 10)
        await there.tower.camera_is(CameraState.LIVE)
        gone, said = there.pid, len(there.tower.camera_states)
        async with flight_notices_nothing(there):
            os.kill(gone, number)
            killed_at = time.monotonic()
            await until(lambda: len(there.tower.camera_states) > said, what="it is said")
            assert there.tower.camera_states[said].camera is CameraState.LOST
            assert there.tower.camera_states[said].words in first_words
            await until(lambda: not exists(gone), what="the old one is gone")
            await until(lambda: len(there.tower.channels) == 2, 30.0, "another channel")
            another_at = time.monotonic()
            await until(lambda: len(there.tower.of(MEDIUM, another_at)) >= 5, 30.0, "pictures")
            await there.tower.camera_is(CameraState.LIVE)
        assert STOPPED_WORDS in [state.words for state in there.tower.camera_states[said:]]
        assert there.pid != gone
        new = [unit for unit in there.tower.of(MEDIUM, killed_at) if unit.is_break]
        assert new[0].key
        assert not new[0].sequence, "the first one of the other process"


async def test_a_video_process_that_goes_on_is_kept(film: str) -> None:
    async with scene(film) as there:
        await there.tower.watch(MEDIUM)
        await there.tower.more(MEDIUM, 10)
        await there.tower.camera_is(CameraState.LIVE)
        pid = there.pid
        said = len(there.tower.camera_states)
        os.kill(pid, signal.SIGSTOP)
        await until(lambda: len(there.tower.camera_states) > said, what="it is said")
        os.kill(pid, signal.SIGCONT)
        await until(lambda: there.tower.camera_states[-1].camera is CameraState.LIVE, what="it goes on")
        # Between the two, a busy machine may have it say that pictures stay away.
        words = [state.words for state in there.tower.camera_states[said:]]
        assert (words[0], words[-1]) == (SILENT_WORDS, "")
        await there.tower.more(MEDIUM, 5)
        assert there.pid == pid


async def test_the_camera_is_unplugged_and_comes_back_by_itself() -> None:
    camera = MjpegCamera()
    await camera.plug_in()
    async with scene(f"http://127.0.0.1:{camera.port}/camera") as there:
        await there.tower.watch(MEDIUM)
        await there.tower.more(MEDIUM, 10)
        pid = there.pid
        async with flight_notices_nothing(there):
            await camera.unplug()
            state = await there.tower.camera_is(CameraState.LOST)
            assert f"127.0.0.1:{camera.port}" in state.words
            await camera.plug_in()
            plugged_at = time.monotonic()
            await there.tower.camera_is(CameraState.LIVE)
            await there.tower.more(MEDIUM, 5)
        # A picture from before may come late.
        back = [unit for unit in there.tower.of(MEDIUM, plugged_at) if unit.capture_us >= plugged_at * 1e6]
        assert back[0].key
        assert back[0].is_break
        assert not back[1].is_break
        assert there.pid == pid
        await camera.unplug()


async def test_a_video_channel_that_is_cut_comes_back_with_a_key(film: str) -> None:
    async with scene(film) as there:
        await there.tower.watch(MEDIUM)
        before = await there.tower.more(MEDIUM, 5)
        there.tower.channels[-1].transport.abort()
        cut_at = time.monotonic()
        await until(lambda: len(there.tower.channels) == 2, what="another channel")
        units = await there.tower.more(MEDIUM, 5)
        first = there.tower.of(MEDIUM, cut_at)[0]
        assert first.key
        assert first.sequence > before[-1].sequence
        assert in_order(units)


async def test_the_tower_asks_for_a_key(film: str) -> None:
    async with scene(film) as there:
        await there.tower.watch(MEDIUM)
        units = await there.tower.more(MEDIUM, 30)
        plain = sum(unit.key for unit in units)
        keys = 0
        for _ in range(4):
            await there.tower.ask_for_key(MEDIUM)
            keys += sum(unit.key for unit in await there.tower.more(MEDIUM, 8))
        assert keys >= 3, f"{plain} of 30 without asking"


async def test_a_tower_that_answers_no_unit_gets_few_of_them_and_another_connection(film: str) -> None:
    async with scene(film) as there:
        there.tower.answers = False
        await there.tower.watch(MEDIUM)
        await until(lambda: there.tower.units, what="the first unit")
        await until(lambda: len(there.tower.channels) == 2, 20.0, "another channel")
        assert len(there.tower.units) < 40, "they would have been 100"
        assert there.tower.pings >= 10, "TCP is shown that something is missing"
        there.tower.answers = True
        await there.tower.more(MEDIUM, 48)


async def test_another_ticket_is_used_when_the_first_is_refused(film: str) -> None:
    async with scene(film) as there:
        await there.tower.watch(MEDIUM, ticket="of another link")
        await until(lambda: there.tower.refused, what="refused")
        state = await there.tower.camera_is(CameraState.LIVE)
        state = await until(lambda: there.tower.camera if there.tower.camera and there.tower.camera.words else None)
        assert "401" in state.words
        assert not there.tower.units
        await there.tower.watch(MEDIUM, ticket=TICKET)
        assert (await there.tower.more(MEDIUM, 3))[0].key


async def test_a_new_link_has_a_ticket_of_its_own(film: str) -> None:
    async with scene(film) as there:
        await there.tower.watch(MEDIUM)
        await there.tower.more(MEDIUM, 3)
        pid = there.pid
        assert there.tower.connection is not None
        await there.tower.connection.close(4000, "another link")
        await there.tower.linked(2)
        await until(lambda: there.tower.channels[-1].close_code is not None, what="the old channel has ended")
        there.tower.ticket = "ticket-2"
        await there.tower.watch(MEDIUM, ticket="ticket-2")
        await there.tower.more(MEDIUM, 3)
        assert there.pid == pid, "the process was kept"
        assert not there.tower.refused


async def test_the_clock_is_told_at_once_and_by_the_way_of_the_question(film: str) -> None:
    async with scene(film) as there:
        before_us = time.monotonic_ns() // 1000
        await there.tower.announce(ClockProbe(number=7))
        there.tower.send_urgent(ClockProbe(number=8))
        by_channel = await until(lambda: [m for m in there.tower.messages if isinstance(m, ClockAnswer)])
        by_datagram = await until(lambda: [m for m in there.tower.urgent if isinstance(m, ClockAnswer)])
        after_us = time.monotonic_ns() // 1000
        assert [answer.number for answer in by_channel] == [7]
        assert [answer.number for answer in by_datagram] == [8]
        assert all(before_us <= answer.at_us <= after_us for answer in [*by_channel, *by_datagram])


async def test_without_a_camera_the_agent_says_nothing_of_video() -> None:
    async with scene("none") as there:
        assert VIDEO not in there.tower.hellos[0].takes
        await there.tower.watch(MEDIUM)
        await asyncio.sleep(0.3)
        assert there.tower.camera is None
        assert not there.runs


async def test_nothing_is_left_of_an_agent_that_ends(film: str) -> None:
    async with scene(film) as there:
        await there.tower.watch(MEDIUM)
        await there.tower.more(MEDIUM, 3)
        pid = there.pid
    assert not exists(pid)
