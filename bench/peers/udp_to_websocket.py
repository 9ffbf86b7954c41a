"""A bare UDP-to-WebSocket forwarder on uvloop, the lower bound for Python: `udp_to_websocket.py PORT_FILE [--library]`

It checks nothing, authenticates nobody and decrypts nothing: each datagram is sent at once as one binary message to
every WebSocket. By default it writes the WebSocket header by hand, straight to the transport, which is the minimum
possible; with `--library` it does what people usually write, `websockets.broadcast`. The two port numbers, UDP and TCP,
are written to PORT_FILE.
"""

from __future__ import annotations

import asyncio
import base64
import hashlib
import sys
from pathlib import Path
from typing import Any, ClassVar, cast

import uvloop
from websockets.asyncio.server import ServerConnection, broadcast, serve

MAGIC = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"


class ByHand(asyncio.Protocol):
    """Upgrades every client; ignores what they send afterwards."""

    everybody: ClassVar[set[asyncio.Transport]] = set()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast("asyncio.Transport", transport)
        self._asked = b""

    def data_received(self, data: bytes) -> None:
        if self._transport in self.everybody:
            return
        self._asked += data
        if not self._asked.endswith(b"\r\n\r\n"):
            return
        lines = dict(line.split(b": ", 1) for line in self._asked.split(b"\r\n")[1:] if line)
        accept = base64.b64encode(hashlib.sha1(lines[b"Sec-WebSocket-Key"] + MAGIC).digest())
        self._transport.write(
            b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            b"Sec-WebSocket-Accept: " + accept + b"\r\n\r\n"
        )
        self.everybody.add(self._transport)

    def connection_lost(self, exc: Exception | None) -> None:
        self.everybody.discard(self._transport)


class InByHand(asyncio.DatagramProtocol):
    def datagram_received(self, data: bytes, addr: Any) -> None:
        size = len(data)
        head = bytes((0x82, size)) if size < 126 else b"\x82\x7e" + size.to_bytes(2, "big")
        message = head + data
        for transport in ByHand.everybody:
            transport.write(message)


class InLibrary(asyncio.DatagramProtocol):
    everybody: ClassVar[set[ServerConnection]] = set()

    def datagram_received(self, data: bytes, addr: Any) -> None:
        broadcast(self.everybody, data)


async def stay(connection: ServerConnection) -> None:
    InLibrary.everybody.add(connection)
    try:
        await connection.wait_closed()
    finally:
        InLibrary.everybody.discard(connection)


async def main(port_file: Path, library: bool) -> None:
    loop = asyncio.get_running_loop()
    receiver = InLibrary if library else InByHand
    udp, _ = await loop.create_datagram_endpoint(receiver, local_addr=("127.0.0.1", 0))
    if library:
        listener: Any = await serve(stay, "127.0.0.1", 0, compression=None)
    else:
        listener = await loop.create_server(ByHand, "127.0.0.1", 0)
    tcp_port = listener.sockets[0].getsockname()[1]
    port_file.write_text(f"{udp.get_extra_info('sockname')[1]} {tcp_port}")  # noqa: ASYNC240
    await asyncio.Event().wait()


if __name__ == "__main__":
    uvloop.run(main(Path(sys.argv[1]), "--library" in sys.argv))
