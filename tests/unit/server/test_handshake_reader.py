"""What a WebSocket may send before its client has signed in, and in which portions it is parsed."""

from collections.abc import Callable

import pytest

from server.anonymous.api import read_turns
from server.anonymous.api.read_turns import ReadTurns
from server.anonymous.core.budget import AnonymousBudget, Over
from server.anonymous.core.connections import AnonymousConnection
from server.anonymous.core.limits import LIMITS, AnonymousLimits
from server.anonymous.core.networks import origin_of
from server.link.api.websocket.handshake_reader import HandshakeReader

NO_RESTS = AnonymousLimits(read_slice_s=1_000.0)
ONE_TURN_AT_A_TIME = AnonymousLimits(read_slice_s=1e-9, read_rest_s=1_000.0)


class Line:
    """A socket that notes what is done with it."""

    def __init__(self) -> None:
        self.parsed: list[bytes] = []
        self.reads = True
        self.closing = False

    def is_closing(self) -> bool:
        return self.closing

    def pause(self) -> None:
        self.reads = False

    def resume(self) -> None:
        self.reads = True

    def abort(self) -> None:
        self.closing = True


class Loop:
    """Keeps the one timer of ReadTurns."""

    def __init__(self) -> None:
        self.due: Callable[[], None] | None = None

    def call_later(self, delay_s: float, call: Callable[[], None]) -> None:
        self.due = call

    def beat(self) -> None:
        due, self.due = self.due, None
        if due is not None:
            due()


@pytest.fixture
def loop(monkeypatch: pytest.MonkeyPatch) -> Loop:
    made = Loop()
    monkeypatch.setattr(read_turns.asyncio, "get_running_loop", lambda: made)
    return made


def reader_on(line: Line, limits: AnonymousLimits = NO_RESTS) -> tuple[HandshakeReader, AnonymousBudget]:
    budget = AnonymousBudget(now=0.0, limits=limits)
    anonymous = AnonymousConnection(origin_of("192.0.2.1"), is_known=False, is_proxy=False, cut=line.abort)
    return HandshakeReader(
        line, line.parsed.append, anonymous=anonymous, budget=budget, turns=ReadTurns(budget)
    ), budget


def test_a_long_read_is_parsed_in_portions_and_nothing_is_read_meanwhile(loop: Loop) -> None:
    line = Line()
    reader, _ = reader_on(line)
    sent = bytes(range(256)) * 20
    reader.came(sent)
    assert [len(part) for part in line.parsed] == [LIMITS.handshake_turn_bytes]
    assert not line.reads
    loop.beat()
    assert b"".join(line.parsed) == sent
    assert max(len(part) for part in line.parsed) == LIMITS.handshake_turn_bytes
    assert line.reads


def test_between_two_portions_others_have_their_turn(loop: Loop) -> None:
    line = Line()
    reader, _ = reader_on(line, ONE_TURN_AT_A_TIME)
    reader.came(bytes(4_000))
    loop.beat()
    assert len(line.parsed) == 1


def test_more_than_a_handshake_needs_cuts_the_socket(loop: Loop) -> None:
    line = Line()
    reader, budget = reader_on(line)
    for _ in range(LIMITS.max_handshake_bytes // 512):
        reader.came(bytes(512))
    assert not line.closing
    reader.came(b"x")
    assert line.closing
    assert budget.refused[Over.HANDSHAKE_BYTES] == 1


def test_who_has_signed_in_may_send_as_much_as_they_like_once_the_rest_is_parsed(loop: Loop) -> None:
    line = Line()
    reader, _ = reader_on(line)
    reader.came(bytes(4_000))
    reader.is_admitted = True
    assert not reader.is_over
    reader.came(bytes(LIMITS.max_handshake_bytes))
    assert not line.closing
    loop.beat()
    assert sum(len(part) for part in line.parsed) == 4_000 + LIMITS.max_handshake_bytes
    assert reader.is_over


def test_a_socket_that_has_closed_meanwhile_is_parsed_no_further(loop: Loop) -> None:
    line = Line()
    reader, _ = reader_on(line)
    reader.came(bytes(4_000))
    line.closing = True
    loop.beat()
    assert len(line.parsed) == 1
    assert not line.reads
