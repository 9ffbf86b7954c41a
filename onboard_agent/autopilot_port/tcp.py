"""The autopilot over TCP: `tcp` connects to it, `tcpin` lets it connect. Both start again when the connection ends."""

import asyncio
import errno
import logging
from typing import cast

from onboard_agent.autopilot_port.peer import FAITHFUL_FOR_S
from onboard_agent.autopilot_port.port import MAX_BACKLOG_BYTES, AutopilotPort, OnBytes
from onboard_agent.link.backoff import STEADY_S, Backoff
from onboard_agent.unusable import Unusable

_log = logging.getLogger(__name__)


class _Stream(asyncio.Protocol):
    """One TCP connection with an autopilot."""

    def __init__(self, port: "_TcpPort", received: OnBytes) -> None:
        self._port = port
        self._received = received
        self._loop = asyncio.get_running_loop()
        self.heard_at = self._loop.time()
        self.closed: asyncio.Future[None] = self._loop.create_future()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        # uvloop's transports do not inherit asyncio's classes: the kind of protocol determines the kind of transport.
        self._port.stream_opened(self, cast(asyncio.Transport, transport))

    def data_received(self, data: bytes) -> None:
        self.heard_at = self._loop.time()
        self._received(data)

    def connection_lost(self, exc: Exception | None) -> None:
        self._port.stream_closed(self)
        if not self.closed.done():
            self.closed.set_result(None)


class _TcpPort(AutopilotPort):
    """Base of both ports: at most one stream, and how to write to it."""

    def __init__(self, name: str, host: str, port: int) -> None:
        super().__init__(name)
        self._host = host
        self._port = port
        self._stream: _Stream | None = None
        self._transport: asyncio.Transport | None = None

    def stream_opened(self, stream: _Stream, transport: asyncio.Transport) -> None:
        """A connection is open. It becomes the autopilot's unless another one is alive."""
        if self._stream is not None and self._transport is not None:
            if asyncio.get_running_loop().time() - self._stream.heard_at < FAITHFUL_FOR_S:
                self.counts["second connection refused"] += 1
                transport.abort()
                return
            self._transport.abort()
        self._stream, self._transport = stream, transport
        self.on_open()
        _log.info("%s: connected", self.name)

    def stream_closed(self, stream: _Stream) -> None:
        """A connection has closed."""
        if self._stream is stream:
            self._stream = self._transport = None
            _log.warning("%s: connection closed", self.name)

    @property
    def backlog_bytes(self) -> int:
        """Bytes that wait for the connection."""
        return self._transport.get_write_buffer_size() if self._transport is not None else 0

    def send(self, data: bytes) -> None:
        transport = self._transport
        if transport is None or transport.is_closing():
            self.counts["autopilot not there"] += 1
        elif transport.get_write_buffer_size() + len(data) > MAX_BACKLOG_BYTES:
            self.counts["autopilot too slow"] += 1
        else:
            transport.write(data)


class TcpOut(_TcpPort):
    """Connects to the autopilot, and retries until it succeeds."""

    async def run(self, received: OnBytes) -> None:
        loop = asyncio.get_running_loop()
        backoff = Backoff()
        is_logged = False
        while True:
            try:
                async with asyncio.timeout(2.0):
                    _, stream = await loop.create_connection(lambda: _Stream(self, received), self._host, self._port)
            except (OSError, TimeoutError) as error:
                if not is_logged:
                    _log.warning("%s: cannot connect (%s); trying on", self.name, error or "no answer")
                    is_logged = True
                await asyncio.sleep(backoff.next_delay_s())
                continue
            is_logged = False
            opened_at = loop.time()
            try:
                await asyncio.shield(stream.closed)
            finally:
                if self._transport is not None:
                    self._transport.abort()
            if loop.time() - opened_at >= STEADY_S:
                backoff.reset()
            await asyncio.sleep(backoff.next_delay_s())


class TcpIn(_TcpPort):
    """Listens. The first peer to connect is the autopilot; another is accepted only after that one has been silent."""

    bound_port: int = 0

    async def run(self, received: OnBytes) -> None:
        loop = asyncio.get_running_loop()
        try:
            server = await loop.create_server(lambda: _Stream(self, received), self._host, self._port)
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                raise Unusable(f"{self.name}: TCP port {self._port} is used by another program") from None
            raise Unusable(f"{self.name}: cannot be opened: {error.strerror or error}") from None
        self.bound_port = server.sockets[0].getsockname()[1]
        try:
            await asyncio.Event().wait()
        finally:
            server.close()
            if self._transport is not None:
                self._transport.abort()
