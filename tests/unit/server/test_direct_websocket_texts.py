"""Short messages are handled within the call that delivers them, however the bytes are split; the rest arrives in
order.
"""

import asyncio
import random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from uvicorn import Config
from uvicorn.server import ServerState
from websockets.client import ClientProtocol
from websockets.frames import Frame, Opcode
from websockets.uri import parse_uri
from worlds.tiers import examples

from server.link.api.websocket.direct_websocket import EXTENSION, DirectWebSocket

Sent = list[tuple[str, bytes]]


class Wire(asyncio.Transport):
    """Keeps what was written."""

    def __init__(self) -> None:
        super().__init__({"peername": ("127.0.0.1", 5), "sockname": ("127.0.0.1", 6)})
        self.written = b""
        self.closed = False

    def write(self, data: Any) -> None:
        self.written += bytes(data)

    def is_closing(self) -> bool:
        return self.closed

    def close(self) -> None:
        self.closed = True

    def abort(self) -> None:
        self.closed = True

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        pass

    def pause_reading(self) -> None:
        pass

    def resume_reading(self) -> None:
        pass


async def heard_from(chunks: list[bytes], early: bytes = b"", *, binaries: bool = False) -> Sent:
    """Returns what an application gets from these chunks: directly handled short texts are marked `short`, binary ones
    `whole`."""
    heard: Sent = []
    over = asyncio.Event()

    async def app(scope: Any, receive: Any, send: Any) -> None:
        if early:
            await began.wait()
        await send({"type": "websocket.accept"})
        scope["extensions"][EXTENSION].set_listeners(
            on_text=lambda text: heard.append(("short", text)),
            on_binary=(lambda payload: heard.append(("whole", payload))) if binaries else None,
        )
        ready.set()
        await receive()
        while (message := await receive())["type"] != "websocket.disconnect":
            text = message.get("text")
            heard.append(("text", text.encode()) if text is not None else ("bytes", message["bytes"]))
        over.set()

    began, ready = asyncio.Event(), asyncio.Event()
    config = Config(app, ws_ping_interval=None, log_config=None, ws_max_size=100_000)
    config.load()
    protocol, wire = DirectWebSocket(config, ServerState(), {}), Wire()
    protocol.connection_made(wire)
    client = ClientProtocol(parse_uri("ws://tower.example/"))
    client.send_request(client.connect())
    protocol.data_received(b"".join(client.data_to_send()))
    if early:
        protocol.data_received(early)
        began.set()
    await ready.wait()
    for chunk in chunks:
        protocol.data_received(chunk)
        await asyncio.sleep(0)
    async with asyncio.timeout(30):
        await over.wait()
    protocol.connection_lost(None)
    await asyncio.gather(*protocol.tasks, return_exceptions=True)
    return heard


def frame(opcode: Opcode, payload: bytes, *, fin: bool = True) -> bytes:
    return Frame(opcode, payload, fin=fin).serialize(mask=True)


CLOSE = frame(Opcode.CLOSE, b"\x03\xe8")

messages = st.lists(
    st.one_of(
        st.tuples(st.just("text"), st.integers(0, 125)),
        st.tuples(st.just("text"), st.integers(126, 6_000)),
        st.tuples(st.just("bytes"), st.one_of(st.integers(0, 300), st.integers(60_000, 80_000))),
        st.tuples(st.just("pieces"), st.integers(2, 200)),
        st.tuples(st.just("ping"), st.integers(0, 100)),
    ),
    max_size=12,
)


def bytes_of(reported: list[tuple[str, int]]) -> tuple[bytes, Sent]:
    """Returns the bytes on the wire, and what the application should get from them."""
    wire, expected = b"", []
    for number, (kind, size) in enumerate(reported):
        payload = (b"%d." % number * size)[:size]
        if kind == "pieces":
            wire += frame(Opcode.TEXT, payload[:1], fin=False) + frame(Opcode.CONT, payload[1:])
        else:
            wire += frame({"text": Opcode.TEXT, "bytes": Opcode.BINARY, "ping": Opcode.PING}[kind], payload)
        if kind != "ping":
            expected.append(("bytes" if kind == "bytes" else "text", payload))
    return wire + CLOSE, expected


@settings(max_examples=examples(26, long=160), deadline=None)
@given(
    reported=messages,
    seed=st.integers(0, 1 << 30),
    largest=st.one_of(st.integers(1, 300), st.integers(1_000, 70_000)),
    binaries=st.booleans(),
)
def test_however_the_bytes_are_cut_everything_is_heard_once_and_in_order(
    reported: list[tuple[str, int]], seed: int, largest: int, binaries: bool
) -> None:
    wire, expected = bytes_of(reported)
    rng, chunks = random.Random(seed), []
    while wire:
        size = rng.randint(1, largest)
        chunks.append(wire[:size])
        wire = wire[size:]
    heard = asyncio.run(heard_from(chunks, binaries=binaries))
    plain = {"short": "text", "whole": "bytes"}
    assert [(plain.get(kind, kind), payload) for kind, payload in heard] == expected


def test_what_is_heard_directly_does_not_overtake_what_waits_for_the_application() -> None:
    wire = frame(Opcode.BINARY, b"in two ", fin=False) + frame(Opcode.CONT, b"pieces") + frame(Opcode.BINARY, b"whole")
    heard = asyncio.run(heard_from([wire, frame(Opcode.BINARY, b"later"), CLOSE], binaries=True))
    assert heard == [("bytes", b"in two pieces"), ("bytes", b"whole"), ("whole", b"later")]


@pytest.mark.parametrize("together", [1, 5, 40])
def test_short_texts_never_wait_for_the_application(together: int) -> None:
    texts = [b'{"type":"got","sequence":%d}' % number for number in range(together)]
    wire = b"".join(frame(Opcode.TEXT, text) for text in texts)
    assert asyncio.run(heard_from([wire, CLOSE])) == [("short", text) for text in texts]


@pytest.mark.parametrize("size", [1, 125, 126, 65_535, 65_536, 99_999])
def test_binary_messages_never_wait_where_they_are_heard(size: int) -> None:
    payload = bytes(range(256)) * (size // 256 + 1)
    wire = frame(Opcode.BINARY, payload[:size]) * 2
    for cut in (1, 5, 9, 13, size // 2, size + 3):
        heard = asyncio.run(heard_from([wire[:cut], wire[cut:], CLOSE], binaries=True))
        assert heard == [("whole", payload[:size])] * 2


def test_a_binary_message_that_is_too_large_ends_the_connection() -> None:
    wire = [frame(Opcode.BINARY, b"1"), frame(Opcode.BINARY, bytes(100_001)), frame(Opcode.BINARY, b"2")]
    assert asyncio.run(heard_from(wire, binaries=True)) == [("whole", b"1")]


def test_a_frame_that_began_before_the_handshake_was_over_is_heard_too() -> None:
    first = frame(Opcode.TEXT, b"early")
    heard = asyncio.run(heard_from([first[4:], frame(Opcode.TEXT, b"late"), CLOSE], early=first[:4]))
    assert heard == [("short", b"early"), ("short", b"late")]
