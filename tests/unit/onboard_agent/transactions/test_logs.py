"""Logs are listed, read and sent, with the simulator's own server half, whatever is lost in transit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import pytest
from handler_line import HandlerLine
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from worlds.tiers import examples

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.transactions.file_sending import NotSent, Sending, Sent
from onboard_agent.transactions.log_files import LogFiles
from onboard_agent.transactions.log_frames import CHUNK, LOGS_FAST
from onboard_agent.transactions.log_handler import ARMED, LogHandler
from simulator.ardupilot import ARDUPILOT
from simulator.dialect import Message, mavlink
from simulator.failure_modes import Failure
from simulator.flight import Flight
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.log_protocol import LogServer
from simulator.logbook import Log, Logbook
from simulator.parameters import Parameters
from wire.transactions import LogDownloadWork, LogEntry, LogListWork, Outcome, TransactionProgress

PARAMETERS = Parameters()
BEGAN = 1_767_225_600


class Half:
    """The simulator's server half, with its own logs."""

    def __init__(self, line: HandlerLine, logs: list[bytes], failures: tuple[Failure, ...]) -> None:
        home = Place(47.397742, 8.545594, 488.0)
        self.flight = Flight(FlightSettings(home), PARAMETERS, set(failures), ARDUPILOT)
        self.book = Logbook()
        self.book.logs = [Log(BEGAN + number * 1000, bytearray(data)) for number, data in enumerate(logs)]
        self.server = LogServer(self.flight, self.book, line.say)

    def receive(self, message: Message) -> None:
        self.server.receive(message, (1, 191))

    def tick(self) -> None:
        self.server.tick()


class Tower:
    """A FileSender that ends at once."""

    def __init__(self) -> None:
        self.state: Sending | Sent | NotSent = NotSent("nothing")
        self.got: dict[int, bytes] = {}
        self.answer: Sending | Sent | NotSent = Sent()
        self.stops = 0

    def begin(self, transaction_id: int, path: Path) -> None:
        self.got[transaction_id] = path.read_bytes()
        self.state = self.answer

    def stop(self) -> None:
        self.stops += 1


def log_of(size: int, seed: int = 1) -> bytes:
    return Random(seed).randbytes(size)


@pytest.fixture
def logs(tmp_path: Path) -> Callable[..., HandlerLine]:
    def make(*data: bytes, failures: tuple[Failure, ...] = (), **around: Any) -> HandlerLine:
        tower = Tower()
        line = HandlerLine(LogHandler(FrameMaker(), LogFiles(tmp_path / "logs"), tower), **around)
        line.server = Half(line, list(data), failures)
        line.tower = tower
        return line

    return make


def kept(tmp_path: Path) -> list[tuple[str, int]]:
    return [(path.name, path.stat().st_size) for path in (tmp_path / "logs").iterdir()]


def test_a_list_is_told_newest_first(logs: Any) -> None:
    line = logs(b"a" * 100, b"b" * 200, b"c" * 300)
    result = line.do(LogListWork())
    assert (result.outcome, result.words) == (Outcome.DONE, "There are 3 logs on board.")
    assert result.logs == (
        LogEntry(3, 300, BEGAN + 2000),
        LogEntry(2, 200, BEGAN + 1000),
        LogEntry(1, 100, BEGAN),
    )
    assert line.sent_count("LOG_REQUEST_LIST") == 1
    assert line.passed_up == []
    assert line.sent[-1].get_type() == "LOG_REQUEST_END"


def test_one_on_board_is_one(logs: Any) -> None:
    assert logs(b"a").do(LogListWork()).words == "There is 1 log on board."


def test_none_on_board_is_a_list_too(logs: Any) -> None:
    result = logs().do(LogListWork())
    assert (result.outcome, result.words, result.logs) == (Outcome.DONE, "There are no logs on board.", ())


def test_entries_that_are_lost_are_asked_for_as_ranges(logs: Any) -> None:
    line = logs(*(bytes([n]) * 10 for n in range(9)))
    lost = {3, 4, 8}
    line.to_agent = lambda _number, message: () if message.id in lost and not lost.discard(message.id) else (0.0,)
    assert len(line.do(LogListWork()).logs) == 9
    asked = [(m.start, m.end) for m in line.sent if m.get_type() == "LOG_REQUEST_LIST"]
    assert asked == [(0, 0xFFFF), (3, 4), (8, 8)]


def test_an_entry_that_never_comes_makes_it_a_part_of_the_list(logs: Any) -> None:
    line = logs(*(bytes([n]) * 10 for n in range(3)))
    line.to_agent = lambda _number, message: () if message.id == 2 else (0.0,)
    result = line.do(LogListWork())
    assert (result.outcome, result.words) == (Outcome.FAILED, "The autopilot listed 2 of its 3 logs.")
    assert [log.log_id for log in result.logs] == [3, 1]


def test_px4_numbers_them_from_0(logs: Any) -> None:
    line = logs()

    def receive(message: Message) -> None:
        if message.get_type() == "LOG_REQUEST_LIST":
            for number in range(message.start, min(message.end, 2) + 1):
                line.say(mavlink.MAVLink_log_entry_message(number, 3, 2, 0, 100 + number))

    line.server.receive = receive
    lost = {1}
    line.to_agent = lambda _number, message: () if message.id in lost and not lost.discard(message.id) else (0.0,)
    result = line.do(LogListWork())
    assert result.logs == (LogEntry(2, 102, None), LogEntry(1, 101, None), LogEntry(0, 100, None))


@pytest.mark.parametrize("work", [LogListWork(), LogDownloadWork(1)], ids=["list", "download"])
def test_an_autopilot_that_says_nothing_is_told_in_words(logs: Any, work: Any) -> None:
    line = logs(b"a" * 100)
    line.to_server = lambda _number, _message: ()
    result = line.do(work)
    assert result.outcome is Outcome.FAILED
    assert result.words.startswith("The logs cannot be listed: the autopilot does not answer")
    assert line.sent_count("LOG_REQUEST_LIST") == LOGS_FAST.tries


@pytest.mark.parametrize("size", [1, CHUNK, CHUNK + 1, LOGS_FAST.window, LOGS_FAST.window * 2 + 12345])
def test_a_log_is_read_and_sent_and_not_kept(logs: Any, tmp_path: Path, size: int) -> None:
    line = logs(b"other", log_of(size))
    number = line.begin(LogDownloadWork(2))
    result = line.result(number)
    assert (result.outcome, result.words) == (Outcome.DONE, f"The log was read and sent: {size} bytes.")
    assert line.tower.got == {number: log_of(size)}
    assert kept(tmp_path) == []
    assert line.passed_up == []
    asked = [(m.ofs, m.count) for m in line.sent if m.get_type() == "LOG_REQUEST_DATA"]
    window = LOGS_FAST.window
    assert asked == [(at, min(window, size - at)) for at in range(0, size, window)]
    assert line.sent[-1].get_type() == "LOG_REQUEST_END"
    took_s = line.now - 100.0
    assert took_s < size / 180_000 + 0.3  # the simulator sends 180 kB a second


def test_every_seventh_piece_is_lost(logs: Any) -> None:
    data = log_of(LOGS_FAST.window + 777)
    line = logs(data, failures=(Failure.LOG_DATA_DROPPED,))
    assert line.do(LogDownloadWork(1)).outcome is Outcome.DONE
    assert line.tower.got == {1: data}


@settings(max_examples=examples(8, long=50), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 1 << 32))
def test_whatever_is_lost_doubled_and_overtaken_it_is_the_log(logs: Any, seed: int) -> None:
    random = Random(seed)
    data = log_of(random.randrange(1, LOGS_FAST.window * 2), seed)
    line = logs(data)
    lost_in_a_row = 0

    def fault(_number: int, _message: Message) -> tuple[float, ...]:
        nonlocal lost_in_a_row
        copies = random.choice((0, 1, 1, 1, 1, 1, 2))
        lost_in_a_row = 0 if copies else lost_in_a_row + 1
        # Of some hundred requests one would fail in all of its tries.
        return tuple(random.random() * 0.05 for _ in range(max(copies, lost_in_a_row > LOGS_FAST.tries // 2)))

    line.to_agent = line.to_server = fault
    result = line.do(LogDownloadWork(1))
    assert result.outcome is Outcome.DONE, result.words
    assert line.tower.got == {1: data}


def test_what_comes_twice_counts_once_and_what_others_asked_for_not_at_all(logs: Any) -> None:
    data = log_of(LOGS_FAST.window * 2)
    line = logs(b"other", data)
    line.to_agent = lambda _number, _message: (0.0, 0.0)
    line.begin(LogDownloadWork(2))
    line.handler.due(line.around(), line.now)
    line.say(mavlink.MAVLink_log_entry_message(1, 2, 2, BEGAN, 5))
    line.until(lambda: line.sent_count("LOG_REQUEST_DATA"))
    for offset in (1, 91, LOGS_FAST.window * 2):
        line.say(mavlink.MAVLink_log_data_message(2, offset, 90, [7] * 90))
    line.say(mavlink.MAVLink_log_data_message(1, 0, 5, [7] * 90))
    assert line.result().outcome is Outcome.DONE
    assert line.tower.got == {1: data}
    assert line.sent_count("LOG_REQUEST_DATA") == 2


def test_a_log_that_is_shorter_than_the_list_said(logs: Any) -> None:
    data = log_of(5000)
    line = logs(data)
    line.to_agent = longer
    assert line.do(LogDownloadWork(1)).outcome is Outcome.DONE
    assert line.tower.got == {1: data}
    even = log_of(CHUNK * 20)
    line = logs(even)
    line.to_agent = longer
    assert line.do(LogDownloadWork(1)).outcome is Outcome.DONE
    assert line.tower.got == {1: even}


def longer(_number: int, message: Message) -> tuple[float, ...]:
    if message.get_type() == "LOG_ENTRY":
        message.size += 100_000
    return (0.0,)


def test_progress_is_told_of_both_halves(logs: Any) -> None:
    line = logs(log_of(200_000))
    line.tower.answer = Sending(0)
    number = line.begin(LogDownloadWork(1))
    line.until(lambda: isinstance(line.tower.state, Sending))
    line.tower.state = Sending(150_000)
    line.run(0.5)
    line.tower.state = Sent()
    assert line.result(number).outcome is Outcome.DONE
    reported = [(one.phase, one.total) for one in line.reported(TransactionProgress)]
    assert list(dict.fromkeys(reported)) == [("listing", 1), ("reading", 200_000), ("sending", 200_000)]
    assert line.reported(TransactionProgress)[-1].done == 150_000
    assert line.tower.stops == 1


def test_what_was_read_is_kept_until_it_is_sent_and_goes_on_from_there(logs: Any, tmp_path: Path) -> None:
    data = log_of(LOGS_FAST.window * 3 + 100)
    line = logs(data)
    number = line.begin(LogDownloadWork(1))
    line.until(lambda: any(m.get_type() == "LOG_REQUEST_DATA" and m.ofs == LOGS_FAST.window * 2 for m in line.sent))
    line.handler.cancel(number, line.now)
    result = line.result(number)
    assert result.outcome is Outcome.CANCELLED
    assert "continue from there" in result.words
    assert [size for _, size in kept(tmp_path)] == [LOGS_FAST.window * 2]
    line.sent.clear()
    line.tower.answer = NotSent("there is no room for it")
    refused = line.do(LogDownloadWork(1))
    assert (refused.outcome, "there is no room for it" in refused.words) == (Outcome.FAILED, True)
    asked = [m.ofs for m in line.sent if m.get_type() == "LOG_REQUEST_DATA"]
    assert asked == [LOGS_FAST.window * 2, LOGS_FAST.window * 3]
    line.sent.clear()
    line.tower.answer = Sent()
    assert line.do(LogDownloadWork(1)).outcome is Outcome.DONE
    assert line.sent_count("LOG_REQUEST_DATA") == 0
    assert line.tower.got[3] == data
    assert kept(tmp_path) == []


def test_another_log_takes_the_place_of_what_was_kept(logs: Any, tmp_path: Path) -> None:
    line = logs(log_of(1000), log_of(2000))
    line.tower.answer = NotSent("no")
    line.do(LogDownloadWork(1))
    line.do(LogDownloadWork(2))
    assert kept(tmp_path) == [(f"2-{BEGAN + 1000}-2000.log", 2000)]


def test_after_a_reboot_the_log_has_another_number_and_nothing_is_mixed(logs: Any, tmp_path: Path) -> None:
    line = logs(log_of(1000), log_of(LOGS_FAST.window * 2, 2), log_of(LOGS_FAST.window * 2, 3))
    line.begin(LogDownloadWork(2))
    line.until(lambda: any(m.get_type() == "LOG_REQUEST_DATA" and m.ofs for m in line.sent))
    line.server.book.logs.pop(0)
    line.comes()
    result = line.result()
    assert result.outcome is Outcome.DONE
    assert line.tower.got == {1: log_of(LOGS_FAST.window * 2, 3)}
    assert kept(tmp_path) == []


def test_after_a_reboot_it_goes_on_where_it_was(logs: Any) -> None:
    data = log_of(LOGS_FAST.window * 2)
    line = logs(data)
    line.begin(LogDownloadWork(1))
    line.until(lambda: any(m.get_type() == "LOG_REQUEST_DATA" and m.ofs for m in line.sent))
    line.sent.clear()
    line.comes()
    assert line.result().outcome is Outcome.DONE
    assert line.tower.got == {1: data}
    assert [m.ofs for m in line.sent if m.get_type() == "LOG_REQUEST_DATA"] == [LOGS_FAST.window]


def test_it_stops_sending_in_the_middle(logs: Any) -> None:
    line = logs(log_of(100_000))
    line.to_agent = lambda number, _message: (0.0,) if number < 300 else ()
    result = line.do(LogDownloadWork(1))
    assert result.outcome is Outcome.FAILED
    assert result.words.startswith(
        "The log was not read to its end: the autopilot sends no more of it. The drone keeps"
    )


def test_armed_there_are_no_logs(logs: Any) -> None:
    line = logs(log_of(100), armed=True)
    for work in (LogListWork(), LogDownloadWork(1)):
        result = line.do(work)
        assert (result.outcome, result.words) == (Outcome.REFUSED, ARMED)
    assert line.sent == []


@pytest.mark.parametrize("phase", ["reading", "sending"])
def test_when_it_is_armed_meanwhile_that_is_the_end_of_it(logs: Any, phase: str) -> None:
    line = logs(log_of(100_000))
    line.tower.answer = Sending(0)
    number = line.begin(LogDownloadWork(1))
    line.until(lambda: any(one.phase == phase for one in line.reported(TransactionProgress)))
    line.around_options["armed"] = True
    result = line.result(number)
    assert (result.outcome, result.words.startswith(ARMED)) == (Outcome.FAILED, True)
    assert line.tower.stops == (1 if phase == "sending" else 0)
    assert line.sent[-1].get_type() == "LOG_REQUEST_END"


def test_the_deadline_and_a_second_one(logs: Any) -> None:
    line = logs(log_of(100_000))
    number = line.begin(LogDownloadWork(1), deadline_s=0.3)
    assert line.do(LogListWork()).words.startswith("Busy")
    assert line.result(number).outcome is Outcome.TIMED_OUT


@pytest.mark.parametrize("wanted", [7, 2])
def test_a_log_that_is_not_there_or_empty(logs: Any, wanted: int) -> None:
    line = logs(log_of(100), b"")
    result = line.do(LogDownloadWork(wanted))
    assert (result.outcome, f"no log {wanted}" in result.words or "cannot be listed" in result.words) == (
        Outcome.FAILED,
        True,
    )


def test_a_disk_without_room_and_an_agent_without_a_directory(
    logs: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    line = logs(log_of(100))
    line.handler = LogHandler(FrameMaker(), LogFiles(None), line.tower)
    words = line.do(LogDownloadWork(1)).words
    assert words == "The log cannot be kept beside the autopilot: the agent was given no directory for it."
    line = logs(log_of(100))
    monkeypatch.setattr("shutil.disk_usage", lambda _path: type("Usage", (), {"free": 64 * 1024 * 1024}))
    assert "has 67 MB left" in line.do(LogDownloadWork(1)).words


def test_a_file_that_cannot_be_removed_is_no_harm(tmp_path: Path) -> None:
    files = LogFiles(tmp_path / "logs")
    files.open(LogEntry(1, 1000, BEGAN))
    files.path.unlink()
    files.remove()


def test_a_file_that_grew_wrong_is_cut_to_whole_pieces(tmp_path: Path) -> None:
    files = LogFiles(tmp_path / "logs")
    log = LogEntry(1, 1000, BEGAN)
    assert files.open(log) == 0
    files.append(b"x" * (CHUNK * 3 + 5))
    assert files.open(log) == CHUNK * 3
    files.append(b"x" * 2000)
    assert files.open(log) == 990
    assert files.open(LogEntry(1, 1000, None)) == 0
    files.append(b"x" * 90)
    assert files.open(LogEntry(1, 1000, None)) == 0
