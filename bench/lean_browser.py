"""A receiver at the end of a relay that costs the load process almost nothing: a hand-written WebSocket client.

It understands only what a server may send (unmasked frames, fragments, pings). The fan-out benchmark uses fifty of them
at once.
"""

from __future__ import annotations

import asyncio
import base64
import os
from collections.abc import Callable
from typing import Final, cast
from urllib.parse import urlsplit

_CONTINUATION, _TEXT, _BINARY, _CLOSE, _PING, _PONG = 0, 1, 2, 8, 9, 10
_MASK: Final = b"\0\0\0\0"
"""A client must mask; a mask of zeros is valid."""


class UpgradeRefused(Exception):
    """The server did not switch to WebSocket; carries its response."""


class LeanBrowser(asyncio.Protocol):
    """Created by `connect_browser`. `on_binary` and `on_text` get whole messages as they arrive."""

    def __init__(self) -> None:
        self.on_binary: Callable[[bytes], None] = lambda message: None
        self.on_text: Callable[[bytes], None] = lambda message: None
        self.on_closed: Callable[[], None] = lambda: None
        self.messages = 0
        """Binary ones."""
        self.bytes = 0
        """In binary messages."""
        self.upgraded: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self.closed = False
        self._buffer = b""
        self._parts: list[bytes] = []
        self._kind = 0
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)  # uvloop's transport has no base class

    def data_received(self, data: bytes) -> None:
        self._buffer += data
        if not self.upgraded.done():
            head, separator, rest = self._buffer.partition(b"\r\n\r\n")
            if not separator:
                return
            if b" 101 " not in head.split(b"\r\n", 1)[0]:
                self.upgraded.set_exception(UpgradeRefused(head.decode("latin-1")))
                return
            self._buffer = rest
            self.upgraded.set_result(None)
        at = 0
        while (after := self._frame(at)) > 0:
            at = after
        self._buffer = self._buffer[at:]

    def _frame(self, at: int) -> int:
        """Takes the frame that begins at `at`; returns where the next begins, or 0 if it is not complete yet."""
        buffer = self._buffer
        if len(buffer) < at + 2:
            return 0
        length, body = buffer[at + 1] & 0x7F, at + 2
        if length >= 126:
            width = 2 if length == 126 else 8
            if len(buffer) < body + width:
                return 0
            length = int.from_bytes(buffer[body : body + width], "big")
            body += width
        if len(buffer) < body + length:
            return 0
        self._take(buffer[at] & 0x0F, bool(buffer[at] & 0x80), buffer[body : body + length])
        return body + length

    def _take(self, opcode: int, final: bool, payload: bytes) -> None:
        if opcode == _PING:
            self._send(_PONG, payload)
        elif opcode in (_TEXT, _BINARY, _CONTINUATION):
            if opcode != _CONTINUATION:
                self._kind = opcode
            self._parts.append(payload)
            if final:
                message = b"".join(self._parts)
                self._parts.clear()
                if self._kind == _BINARY:
                    self.messages += 1
                    self.bytes += len(message)
                    self.on_binary(message)
                else:
                    self.on_text(message)

    def send_text(self, words: str) -> None:
        self._send(_TEXT, words.encode())

    def send_binary(self, message: bytes) -> None:
        self._send(_BINARY, message)

    def _send(self, opcode: int, payload: bytes) -> None:
        assert self._transport is not None
        size = len(payload)
        length = bytes((0x80 | size,)) if size < 126 else b"\xfe" + size.to_bytes(2, "big")
        self._transport.write(bytes((0x80 | opcode,)) + length + _MASK + payload)

    def connection_lost(self, exc: Exception | None) -> None:
        self.closed = True
        self.on_closed()
        if not self.upgraded.done():
            self.upgraded.set_exception(exc or ConnectionError("closed before the upgrade"))

    def close(self) -> None:
        if self._transport is not None:
            self._transport.abort()


async def connect_browser(
    url: str,
    *,
    path: str,
    cookie: str = "",
    subprotocol: str = "",
    before: Callable[[LeanBrowser], None] | None = None,
    address: str = "",
) -> LeanBrowser:
    """Opens `path` at `url` (http://host:port), from `address` if one is given. `before` sets the listeners. Raises
    UpgradeRefused or OSError."""
    place = urlsplit(url)
    assert place.hostname is not None and place.port is not None
    headers = [
        f"GET {path} HTTP/1.1",
        f"Host: {place.hostname}:{place.port}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        "Sec-WebSocket-Version: 13",
        f"Sec-WebSocket-Key: {base64.b64encode(os.urandom(16)).decode()}",
        f"Origin: {url}",
    ]
    headers += [f"Cookie: {cookie}"] if cookie else []
    headers += [f"Sec-WebSocket-Protocol: {subprotocol}"] if subprotocol else []
    loop = asyncio.get_running_loop()
    local = (address, 0) if address else None
    transport, browser = await loop.create_connection(LeanBrowser, place.hostname, place.port, local_addr=local)
    if before is not None:
        before(browser)
    transport.write("\r\n".join([*headers, "", ""]).encode())
    await asyncio.wait_for(browser.upgraded, 10)
    return browser
