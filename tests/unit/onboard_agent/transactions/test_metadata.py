"""Component metadata is requested, read and forwarded; refusals, losses and damaged files."""

from __future__ import annotations

import json
import lzma
from collections.abc import Callable
from typing import Any

import pytest
from handler_line import HandlerLine

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.transactions import metadata_service as service
from onboard_agent.transactions.metadata_general import (
    mavlink_crc32,
)
from onboard_agent.transactions.metadata_service import ASK_TRIES, COMPONENT, FILE_TRIES, MetadataService
from simulator.dialect import ComponentMetadata, Message, mavlink
from simulator.file_protocol import OPEN_TO_READ, READ, TERMINATE, FileServer
from simulator.metadata import GENERAL, PARAMETERS, ComponentFiles, parameter_document
from simulator.parameters import Parameters
from wire.parameter_metadata import (
    MAX_PIECE_BYTES,
    MetadataDocument,
    MetadataKnown,
    MetadataPiece,
    metadata_hash,
    read_metadata,
    unpack_text,
)

FTP = "FILE_TRANSFER_PROTOCOL"
ASK = mavlink.MAV_CMD_REQUEST_MESSAGE

ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3


class Offering:
    """The autopilot's half: answers REQUEST_MESSAGE with `result`, and serves files."""

    def __init__(self, line: HandlerLine, file: Callable[[bytes], bytes | None] | None = None) -> None:
        self.parameters = Parameters()
        self.component = ComponentFiles(self.parameters)
        self.files = FileServer(self.parameters, line.say, file=file or self.component.file)
        self.result: int | None = ACCEPTED
        self.named: Callable[[], Any] | None = lambda: self.component.named(5)
        self._line = line

    def receive(self, message: Message) -> None:
        peer = (message.get_srcSystem(), message.get_srcComponent())
        if message.get_type() == FTP:
            self.files.receive(message, peer)
        elif message.get_type() == "COMMAND_LONG" and self.result is not None:
            assert (message.command, message.param1) == (ASK, 397)
            self._line.say(mavlink.MAVLink_command_ack_message(ASK, self.result, 0, 0, *peer))
            if self.result == ACCEPTED and self.named is not None:
                self._line.say(self.named())

    def tick(self) -> None:
        self.files.tick(self._line.now)


class MetadataLine(HandlerLine):
    """`parameters_busy`: the current work of the parameter handler."""

    def __init__(self, file: Callable[[bytes], bytes | None] | None = None, **around: Any) -> None:
        self.parameters_busy = False
        self.service = MetadataService(FrameMaker(), parameters_busy=lambda _now: self.parameters_busy)
        super().__init__(self.service, **around)
        self.offering = Offering(self, file)
        self.server = self.offering

    def version(self, capabilities: int = mavlink.MAV_PROTOCOL_CAPABILITY_FTP) -> None:
        names = (capabilities, 0, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0)
        self.say(mavlink.MAVLink_autopilot_version_message(*names))

    def known(self) -> MetadataKnown:
        return self.reported(MetadataKnown)[-1]

    def until_known(self) -> float:
        return self.until(lambda: self.reports and self.known().hash is not None)

    def until_none(self, words: str) -> None:
        self.until(lambda: self.reports and self.known().hash is None and words in self.known().words, 120.0)

    def asks(self) -> int:
        return self.sent_count("COMMAND_LONG")

    def opened(self) -> list[bytes]:
        """Returns the names of opened files, in order."""
        ours = [bytes(one.payload) for one in self.sent if one.get_type() == FTP]
        return [one[12 : 12 + one[4]] for one in ours if one[3] == OPEN_TO_READ]

    def ops(self, op: int) -> int:
        return sum(1 for one in self.sent if one.get_type() == FTP and one.payload[3] == op)


def come(file: Callable[[bytes], bytes | None] | None = None, **around: Any) -> MetadataLine:
    line = MetadataLine(file, **around)
    line.comes()
    line.version()
    return line


def whole(line: MetadataLine) -> MetadataDocument:
    """Returns what the tower assembles from the pieces."""
    hash_ = line.known().hash
    assert hash_ is not None
    line.service.wanted(hash_)
    size = line.known().size_bytes
    before = len(line.reported(MetadataPiece))
    line.until(lambda: sum(len(one.data) for one in line.reported(MetadataPiece)[before:]) >= size)
    data = b""
    for piece in line.reported(MetadataPiece)[before:]:
        assert (piece.hash, piece.offset) == (hash_, len(data))
        assert len(piece.data) <= MAX_PIECE_BYTES
        data += piece.data
    assert metadata_hash(data) == hash_
    return read_metadata(unpack_text(data))


def test_it_is_asked_for_after_the_version_read_and_told_as_the_vehicle_has_it() -> None:
    line = come()
    assert line.until_known() < 5.0
    assert line.asks() == 1
    assert [bytes(name) for name in line.opened()] == [GENERAL.encode(), PARAMETERS.encode()]
    line.run(1.0)
    assert line.ops(TERMINATE) == 2
    assert {one.get_srcComponent() for one in line.sent} == {COMPONENT}
    assert not [one for one in line.passed_up if one.get_type() in (FTP, "COMMAND_ACK")], "the answers are ours alone"
    document = whole(line)
    expected = parameter_document(line.offering.parameters)["parameters"]
    assert [one.name for one in document.parameters] == [one["name"] for one in expected]
    found = {one.name: one for one in document.parameters}
    assert (found["RTL_ALT"].units, found["RTL_ALT"].default, found["RTL_ALT"].min) == ("cm", 1500.0, 30.0)
    assert [one.index for one in found["FS_OPTIONS"].bitmask] == [0, 1, 2, 3, 4]
    assert found["FLTMODE1"].values[0].description == "STABILIZE"


def test_without_a_version_or_without_files_nothing_is_asked() -> None:
    line = MetadataLine()
    line.comes()
    line.run(10.0)
    line.version(0)
    line.until_none("has no MAVLink FTP")
    line.run(10.0)
    assert line.asks() == 0


@pytest.mark.parametrize("result", [DENIED, UNSUPPORTED, 4])
def test_a_refusal_is_final_until_it_comes_again(result: int) -> None:
    line = come()
    line.offering.result = result
    line.until_none("offers none")
    line.run(60.0)
    line.version()
    line.run(60.0)
    assert line.asks() == 1
    line.offering.result = ACCEPTED
    line.comes()
    line.version()
    line.until_known()


def test_silence_is_final_as_well() -> None:
    for line in (come(), come()):
        line.offering.named = None
        line.until_none("does not answer")
        line.run(60.0)
        assert line.asks() == ASK_TRIES
    silent = come()
    silent.offering.result = None
    silent.until_none("does not answer")
    assert silent.asks() == ASK_TRIES


@pytest.mark.parametrize("what", ["armed", "holding", "starting", "busy"])
def test_nothing_is_asked_or_read_while_there_is_something_else_to_do(what: str) -> None:
    line = come(**{what: True})
    line.run(30.0)
    assert line.sent == []
    line.around_options = {}
    line.until(lambda: line.ops(READ) > 2)
    line.around_options = {what: True}
    line.step()
    line.run(0.2)
    sent = len(line.sent)
    assert line.ops(TERMINATE) == line.ops(OPEN_TO_READ), "no file is left open"
    line.run(30.0)
    assert len(line.sent) == sent
    line.around_options = {}
    line.until_known()


def test_parameters_that_are_read_come_first() -> None:
    line = come()
    line.parameters_busy = True
    line.run(20.0)
    assert line.sent == []
    line.parameters_busy = False
    line.until(lambda: line.ops(READ) > 2)
    line.parameters_busy = True
    before = len(line.sent)
    line.step()
    assert line.sent[before].payload[3] == TERMINATE, "before anything of theirs goes out"
    line.run(5.0)
    line.parameters_busy = False
    line.until_known()


def test_pieces_wait_until_it_is_disarmed_and_begin_anew_on_another_link() -> None:
    line = come(lambda name: large.get(name))
    large = offered(wordy(2000))
    line.offering.named = lambda: named(large)
    line.until_known()
    hash_ = line.known().hash
    assert hash_ is not None
    line.around_options = {"armed": True}
    line.service.wanted("0" * 16)
    line.service.wanted(hash_)
    line.run(10.0)
    assert line.reported(MetadataPiece) == []
    line.around_options = {}
    line.until(lambda: len(line.reported(MetadataPiece)) == 2)
    line.handler.resend()
    line.run(10.0)
    assert len(line.reported(MetadataPiece)) == 2, "the tower asks for what it lacks"
    assert line.known().hash == hash_
    assert len(whole(line).parameters) == 2000


def test_a_file_whose_crc_is_known_is_not_read_again_and_another_one_is() -> None:
    files = offered([{"name": "ALPHA"}])
    line = come(lambda name: files.get(name))
    line.offering.named = lambda: named(files)
    line.until_known()
    reported = len(line.reported(MetadataKnown))
    line.comes()
    line.version()
    line.run(20.0)
    assert line.opened() == [b"g", b"p", b"g"]
    assert len(line.reported(MetadataKnown)) == reported
    files.update(offered([{"name": "BETA"}]))
    line.comes()
    line.version()
    line.until(lambda: len(line.reported(MetadataKnown)) == reported + 1)
    assert line.opened()[-2:] == [b"g", b"p"]
    assert [one.name for one in whole(line).parameters] == ["BETA"]


def test_another_autopilot_is_another_matter() -> None:
    line = come()
    line.until_known()
    line.kind = 12
    line.comes()
    line.step()
    assert line.known().hash is None
    line.version()
    line.until_known()


@pytest.mark.parametrize("lost", [5, 7])
def test_what_is_lost_is_asked_for_again(lost: int) -> None:
    line = MetadataLine()
    line.to_agent = lambda number, message: () if message.get_type() == FTP and number % lost == 0 else (0.0,)
    line.comes()
    line.version()
    line.until_known()
    assert len(whole(line).parameters) == len(line.offering.parameters)


def test_a_file_that_is_missing_or_damaged_is_tried_again_and_then_said_so() -> None:
    missing = come()
    missing.offering.component.missing = True
    missing.until_none("could not be read: the autopilot refuses")
    assert missing.opened().count(PARAMETERS.encode()) == FILE_TRIES
    damaged = come()
    damaged.offering.component.damaged = True
    damaged.until(lambda: damaged.opened().count(PARAMETERS.encode()) == 2)
    damaged.offering.component.damaged = False
    damaged.until_known()
    bad = come()
    bad.offering.component.damaged = True
    bad.until_none("damaged")
    bad.run(60.0)
    assert bad.opened().count(PARAMETERS.encode()) == FILE_TRIES


def test_an_autopilot_that_answers_no_request_for_files_ends_it_in_bounded_time() -> None:
    line = come()
    line.to_server = lambda _number, message: () if message.get_type() == FTP else (0.0,)
    line.until_none("the autopilot does not answer")
    line.run(60.0)
    assert line.ops(OPEN_TO_READ) == 3 * FILE_TRIES


def test_a_file_that_comes_too_slowly_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service, "FILE_WITHIN_S", 3.0)
    files = offered(wordy(3000))
    line = come(lambda name: files.get(name))
    line.offering.named = lambda: named(files)
    line.to_agent = lambda _number, message: (0.9,) if message.get_type() == FTP else (0.0,)
    line.until_none("could not be read: it was given up")


@pytest.mark.parametrize(
    ("address", "words"),
    [
        (b"https://example.invalid/general.json", "is not on board: it is not fetched"),
        (b"mftp://[;comp=100]general.json", "is not on board: it is not fetched"),
        (b"", "is not on board: it is not fetched"),
    ],
)
def test_what_is_not_on_the_autopilot_is_not_fetched(address: bytes, words: str) -> None:
    line = come()
    line.offering.named = lambda: ComponentMetadata(1, 0, address)
    line.until_none(words)
    assert line.opened() == []


def test_a_message_that_others_asked_for_begins_nothing() -> None:
    line = MetadataLine()
    line.comes()
    line.say(line.offering.component.named(1))
    line.run(10.0)
    assert line.sent == []


# The files.


def offered(entries: list[Any], *, pack: bool = True) -> dict[bytes, bytes]:
    """Returns a general file `g` and one of parameters `p`."""
    text = json.dumps({"version": 1, "parameters": entries}).encode()
    data = lzma.compress(text, preset=1) if pack else text
    types = [{"type": 1, "uri": "mftp://[;comp=1]p", "fileCrc": mavlink_crc32(data)}]
    return {b"g": json.dumps({"version": 1, "metadataTypes": types}).encode(), b"p": data}


def named(files: dict[bytes, bytes]) -> ComponentMetadata:
    return ComponentMetadata(1, mavlink_crc32(files[b"g"]), b"mftp://g")


def wordy(count: int) -> list[dict[str, str]]:
    """Returns entries that compress badly."""
    return [{"name": f"P{i}", "longDesc": f"{i * 2654435761 % 2**64:x} {i * 40503:x}"} for i in range(count)]
