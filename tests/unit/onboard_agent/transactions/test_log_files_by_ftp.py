"""Logs are read by MAVLink FTP, with the simulator's own server halves: bursts, lost pieces, checksum, and the way back
to LOG_REQUEST_DATA."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import pytest
from handler_line import ARDUPILOT, PX4, HandlerLine
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from test_logs import BEGAN, Half, Tower, kept, log_of
from worlds.tiers import examples

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.transactions import log_file_search
from onboard_agent.transactions.file_frames import MAX_BLOCK_BYTES
from onboard_agent.transactions.log_files import LogFiles
from onboard_agent.transactions.log_handler import COMPONENT, LogHandler
from simulator.dialect import Message, mavlink
from simulator.failure_modes import Failure
from simulator.file_protocol import (
    ACK,
    BURST,
    BURST_BLOCKS,
    CHECKSUM,
    HEAD,
    LIST,
    NACK,
    OPEN_TO_READ,
    READ,
    TERMINATE,
    FileServer,
)
from simulator.parameters import Parameters
from simulator.served_files import ServedFiles
from wire.transactions import LogDownloadWork, Outcome, TransactionProgress

CHECKED = ", with the checksum that the autopilot has."
FTP = "FILE_TRANSFER_PROTOCOL"


class BothHalves(Half):
    """The simulator's logs, by messages and as files."""

    def __init__(self, line: HandlerLine, logs: list[bytes], failures: tuple[Failure, ...], *, by_day: bool) -> None:
        super().__init__(line, logs, failures)
        self.line = line
        self.served = ServedFiles(self.book, None, by_day=by_day)
        self.files = FileServer(Parameters(), line.say, file=self.served.file, entries=self.served.entries)
        self.files.suffer(set(failures))

    def receive(self, message: Message) -> None:
        if message.get_type() == FTP:
            self.files.receive(message, (1, COMPONENT))
        else:
            super().receive(message)

    def tick(self) -> None:
        super().tick()
        self.files.tick(self.line.now)


@pytest.fixture
def logs(tmp_path: Path) -> Callable[..., HandlerLine]:
    def make(
        *data: bytes, failures: tuple[Failure, ...] = (), kind: int = ARDUPILOT, announces: bool = True, **around: Any
    ) -> HandlerLine:
        tower = Tower()
        line = HandlerLine(LogHandler(FrameMaker(), LogFiles(tmp_path / "logs"), tower), kind, **around)
        line.server = BothHalves(line, list(data), failures, by_day=kind == PX4)
        line.tower = tower
        capabilities = mavlink.MAV_PROTOCOL_CAPABILITY_FTP if announces else 0
        line.say(mavlink.MAVLink_autopilot_version_message(capabilities, *[0] * 4, *[[0] * 8] * 3, 0, 0, 0))
        line.step()
        return line

    return make


def asked(line: HandlerLine) -> list[tuple[int, int]]:
    """Operation and offset of each request."""
    found = []
    for message in line.sent:
        if message.get_type() == FTP:
            _, _, op, _, _, _, offset = HEAD.unpack_from(bytes(message.payload))
            found.append((op, offset))
    return found


def operation(message: Message) -> tuple[int, int, int]:
    """Operation of an answer, that of its request, and the offset."""
    if message.get_type() != FTP:
        return 0, 0, 0
    _, _, op, _, request, _, offset = HEAD.unpack_from(bytes(message.payload))
    return op, request, offset


@pytest.mark.parametrize(("kind", "directories"), [(ARDUPILOT, [0]), (PX4, [0, 0])])
@pytest.mark.parametrize("size", [1, MAX_BLOCK_BYTES, 100_001, BURST_BLOCKS * MAX_BLOCK_BYTES + 5])
def test_a_log_is_read_in_bursts_and_checked(
    logs: Any, tmp_path: Path, size: int, kind: int, directories: list[int]
) -> None:
    line = logs(b"other", log_of(size), kind=kind)
    result = line.do(LogDownloadWork(2))
    assert (result.outcome, result.words) == (Outcome.DONE, f"The log was read and sent: {size} bytes{CHECKED}")
    assert line.tower.got == {1: log_of(size)}
    assert kept(tmp_path) == []
    assert line.passed_up[1:] == []  # the first is AUTOPILOT_VERSION, which others need
    whole = BURST_BLOCKS * MAX_BLOCK_BYTES
    assert [one for one in asked(line) if one[0] != LIST] == [
        (OPEN_TO_READ, 0),
        *((BURST, at) for at in range(0, size, whole)),
        (TERMINATE, 0),
        (CHECKSUM, 0),
    ]
    assert [at for op, at in asked(line) if op == LIST and not at] == directories
    assert line.sent_count("LOG_REQUEST_DATA") == 0
    assert line.sent[-1].get_type() == "LOG_REQUEST_END"


def test_it_is_faster_than_by_messages(logs: Any) -> None:
    """In ticks of the simulator, not of a clock: the same number of frames a tick carries more bytes."""
    took = []
    for announces in (True, False):
        line = logs(log_of(400_000), announces=announces)
        line.do(LogDownloadWork(1))
        took.append(line.now - 100.0)
        assert line.tower.got == {1: log_of(400_000)}
    assert took[0] < 0.6 * took[1]


def test_lost_pieces_are_read_one_by_one(logs: Any) -> None:
    line = logs(log_of(100_000))
    lost = {239 * 7, 239 * 8, 239 * 100}

    def fault(_number: int, message: Message) -> tuple[float, ...]:
        op, _, offset = operation(message)
        return () if op == ACK and offset in lost and not lost.discard(offset) else (0.0,)

    line.to_agent = fault
    assert line.do(LogDownloadWork(1)).words.endswith(CHECKED)
    assert line.tower.got == {1: log_of(100_000)}
    assert sorted(at for op, at in asked(line) if op == READ) == [239 * 7, 239 * 8, 239 * 100]
    assert sum(op == BURST for op, _ in asked(line)) == 1


def test_many_lost_pieces_are_asked_for_by_another_burst(logs: Any) -> None:
    line = logs(log_of(200_000))
    line.to_agent = lambda number, message: () if 20 < number < 400 else (0.0,)
    assert line.do(LogDownloadWork(1)).words.endswith(CHECKED)
    assert sum(op == BURST for op, _ in asked(line)) == 2
    assert line.tower.got == {1: log_of(200_000)}


def test_every_seventh_answer_is_lost(logs: Any) -> None:
    data = log_of(150_000)
    line = logs(data, failures=(Failure.FILES_DROPPED,))
    assert line.do(LogDownloadWork(1)).outcome is Outcome.DONE
    assert line.tower.got == {1: data}
    assert line.sent_count("LOG_REQUEST_DATA") == 0


@settings(max_examples=examples(8, long=50), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 1 << 32))
def test_whatever_is_lost_doubled_and_overtaken_it_is_the_log(logs: Any, seed: int) -> None:
    random = Random(seed)
    data = log_of(random.randrange(1, 150_000), seed)
    line = logs(data)

    def fault(_number: int, message: Message) -> tuple[float, ...]:
        if message.get_type() != FTP:
            return (0.0,)
        return tuple(random.random() * 0.05 for _ in range(random.choice((0, 1, 1, 1, 1, 1, 1, 2))))

    line.to_agent = line.to_server = fault
    result = line.do(LogDownloadWork(1))
    assert result.outcome is Outcome.DONE, result.words
    assert line.tower.got == {1: data}


@pytest.mark.parametrize(
    "case", ["not announced", "another autopilot", "refused", "two of this size", "no directory", "silent"]
)
def test_it_is_read_by_messages(logs: Any, case: str) -> None:
    data = log_of(60_000)
    line = logs(
        data,
        *([log_of(60_000, 2)] if case == "two of this size" else []),
        announces=case != "not announced",
        kind=0 if case == "another autopilot" else ARDUPILOT,
        failures=(Failure.FILES_REFUSED,) if case == "refused" else (),
    )
    if case == "no directory":
        line.server.files._entries = lambda _directory: None
    if case == "silent":
        line.to_server = lambda _number, message: () if message.get_type() == FTP else (0.0,)
    result = line.do(LogDownloadWork(1))
    assert (result.outcome, result.words) == (Outcome.DONE, "The log was read and sent: 60000 bytes.")
    assert line.tower.got == {1: data}
    assert line.sent_count("LOG_REQUEST_DATA") > 0


def test_what_is_damaged_on_the_way_is_read_again_by_messages(logs: Any) -> None:
    data = log_of(60_000)
    line = logs(data)

    def fault(_number: int, message: Message) -> tuple[float, ...]:
        if operation(message)[:2] == (ACK, BURST) and operation(message)[2] == 239:
            message.payload = (
                bytes(message.payload[:20]) + bytes([message.payload[20] ^ 1]) + bytes(message.payload[21:])
            )
        return (0.0,)

    line.to_agent = fault
    assert line.do(LogDownloadWork(1)).words == "The log was read and sent: 60000 bytes."
    assert line.tower.got == {1: data}


def test_a_file_that_grew_is_not_taken_for_the_log(logs: Any) -> None:
    line = logs(log_of(60_000))
    line.begin(LogDownloadWork(1))
    line.until(lambda: (LIST, 0) in asked(line))
    line.server.book.logs[0].data.extend(b"more")
    assert line.result().words == "The log was read and sent: 60000 bytes."
    assert line.tower.got == {1: log_of(60_000)}


def test_an_autopilot_that_computes_no_checksum_is_believed(logs: Any) -> None:
    line = logs(log_of(60_000))
    line.server.files._checksum = lambda _name: (NACK, b"\7")
    assert line.do(LogDownloadWork(1)).words == "The log was read and sent: 60000 bytes."
    assert line.sent_count("LOG_REQUEST_DATA") == 0


def test_it_stops_in_the_middle_and_messages_go_on_from_there(logs: Any) -> None:
    data = log_of(300_000)
    line = logs(data)
    line.to_agent = lambda _number, message: () if operation(message)[2] > 150_000 else (0.0,)
    assert line.do(LogDownloadWork(1)).outcome is Outcome.DONE
    assert line.tower.got == {1: data}
    first = next(m.ofs for m in line.sent if m.get_type() == "LOG_REQUEST_DATA")
    assert 149_000 < first <= 150_300


def test_cancelled_it_closes_its_file_and_goes_on_later(logs: Any, tmp_path: Path) -> None:
    data = log_of(300_000)
    line = logs(data)
    number = line.begin(LogDownloadWork(1))
    line.until(lambda: any(one.phase == "reading" and one.done > 100_000 for one in line.reported(TransactionProgress)))
    line.handler.cancel(number, line.now)
    assert "continue from there" in line.result(number).words
    line.run(1.0)
    assert asked(line)[-1][0] == TERMINATE
    ((_, have),) = kept(tmp_path)
    assert have > 100_000
    line.sent.clear()
    assert line.do(LogDownloadWork(1)).words.endswith(CHECKED)  # the checksum covers what was kept
    assert line.tower.got == {2: data}
    assert min(at for op, at in asked(line) if op == BURST) in range(have - 90, have + 1)


def test_a_session_that_was_left_open_is_closed_first(logs: Any) -> None:
    line = logs(log_of(60_000))
    line.server.files._session, line.server.files._heard_at = 193, line.now
    line.server.files._content = b"another file"
    assert line.do(LogDownloadWork(1)).words.endswith(CHECKED)
    assert [op for op, _ in asked(line) if op != LIST][:3] == [OPEN_TO_READ, TERMINATE, OPEN_TO_READ]


def test_a_session_that_the_autopilot_lost_is_opened_again(logs: Any) -> None:
    data = log_of(BURST_BLOCKS * MAX_BLOCK_BYTES * 2)
    line = logs(data)
    line.begin(LogDownloadWork(1))
    line.until(lambda: sum(op == BURST for op, _ in asked(line)) == 2)
    line.server.files._session = None
    assert line.result().words.endswith(CHECKED)
    assert line.tower.got == {1: data}


def test_a_long_list_is_read_to_its_end_and_within_a_bound(logs: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    many = [bytes([number]) * (100 + number) for number in range(60)]
    line = logs(*many)
    assert line.do(LogDownloadWork(60)).words.endswith(CHECKED)
    monkeypatch.setattr(log_file_search, "MAX_ENTRIES", 30)
    line = logs(*many)
    assert line.do(LogDownloadWork(60)).words == "The log was read and sent: 159 bytes."


def test_logs_of_px4_are_found_by_size_in_the_directory_of_their_day(logs: Any) -> None:
    line = logs(*(log_of(1000 + number, number) for number in range(3)), kind=PX4)
    line.server.book.logs[2].begun_unix_s = BEGAN + 86_400
    assert line.do(LogDownloadWork(3)).words.endswith(CHECKED)
    assert line.tower.got == {1: log_of(1002, 2)}
