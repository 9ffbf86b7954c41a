"""The WebSocket that carries units to the tower, kept connected while there is a ticket for it. A thin shell.

Units are written in order, in pieces, each at its time; callers ask LinkRate first, so that the queue stays short. The
kernel's own pacing (SO_MAX_PACING_RATE) does not help: its bursts are as large as a key picture, and its send times
cannot be observed. If the network does not accept data for a while, the connection is dropped.
"""

import asyncio
import contextlib
import logging
import socket
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Sequence
from typing import Final

import msgspec
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus, WebSocketException
from websockets.typing import Subprotocol

from onboard_agent import VERSION
from onboard_agent.link.backoff import STEADY_S, Backoff
from onboard_agent.link.tower_url import TowerUrl
from onboard_agent.sockets.connecting import Unreachable, connect_tcp
from onboard_agent.sockets.control_channel import trust
from onboard_agent.sockets.data_socket import ANY_UPLINK
from onboard_agent.sockets.priorities import waits_for_others
from onboard_agent.video.core.link_memory import LinkMemory
from onboard_agent.video.core.link_rate import LinkRate
from onboard_agent.video.core.streaming import Departure
from onboard_agent.video.core.units_in_transit import piece_bytes, wire_bits
from wire.video import AGENT_VIDEO_SUBPROTOCOL, KeyWanted, MalformedUnit, StreamRequest, decode_got

_log = logging.getLogger(__name__)

OPEN_WITHIN_S: Final = 5.0
CLOSE_WITHIN_S: Final = 0.2
MAX_ANSWER_BYTES: Final = 1024
WRITE_BUFFER_BYTES: Final = 16 * 1024
LOSS_PROBE_EVERY_S: Final = 0.025
"""Three pings let TCP detect a loss. On a lossy 4G line the longest standstill was 0.9 s without pings, and 0.13 s with
them."""
REFUSED_PAUSE_S: Final = 2.0
"""Pause after a rejected ticket: a new one arrives on the control channel."""

_TCP_THIN_LINEAR_TIMEOUTS: Final = 16


_key_requests: Final = msgspec.json.Decoder(KeyWanted)


class VideoChannel:
    """Run it; `send` while `is_open`. `opened`: a new connection, on which every stream begins with a key picture.
    `key_wanted`: the tower requests one. Both are called synchronously on the event loop."""

    def __init__(
        self,
        url: TowerUrl,
        uplinks: Sequence[str],
        ticket: str,
        rate: LinkRate,
        memory: LinkMemory,
        *,
        opened: Callable[[], None],
        key_wanted: Callable[[StreamRequest], None],
    ) -> None:
        self._url = url
        self._uplinks = (*uplinks, ANY_UPLINK) if len(uplinks) > 1 else (ANY_UPLINK,)
        self._ticket = ticket
        self._rate = rate
        self._memory = memory
        self._local: str | None = None
        """Local address of the last connection."""
        self._opened = opened
        self._key_wanted = key_wanted
        self._connection: ClientConnection | None = None
        self._units: deque[Departure] = deque()
        self._more = asyncio.Event()
        self.words = ""
        """Why there is no connection, for users; empty while connected."""

    @property
    def is_open(self) -> bool:
        return self._connection is not None

    def send(self, unit: Departure) -> None:
        """Queues a unit. Units leave in order, at their time or once the network accepts them. Lost on disconnect."""
        self._units.append(unit)
        self._more.set()

    def tick(self) -> None:
        """Call about every 100 ms."""
        if self._connection is None:
            return
        now = time.monotonic()
        if (known := self._rate.known) is not None and self._local is not None:
            self._memory.note(known, self._local, now)
        if self._rate.is_hopeless(now):
            _log.warning("video: nothing gets through; connecting again")
            self._connection.transport.abort()
            self._connection = None

    async def run(self) -> None:
        """Runs until cancelled."""
        backoff = Backoff()
        while True:
            await asyncio.sleep(backoff.next_delay_s())
            try:
                sock = await connect_tcp(self._url, self._uplinks)
                connection = await self._upgrade(sock)
            except InvalidStatus as error:
                self._failed(f"the tower refuses the video channel (HTTP status {error.response.status_code})")
                await asyncio.sleep(REFUSED_PAUSE_S)
                continue
            except (Unreachable, OSError, TimeoutError, WebSocketException, ValueError, EOFError) as error:
                self._failed(f"the video channel cannot be opened: {error or type(error).__name__}")
                continue
            began = time.monotonic()
            await self._serve(connection)
            if time.monotonic() - began >= STEADY_S:
                backoff.reset()

    def _failed(self, words: str) -> None:
        if words != self.words:
            _log.warning("video: %s; trying on", words)
            self.words = words

    async def _upgrade(self, sock: socket.socket) -> ClientConnection:
        prepare(sock)
        try:
            return await connect(
                self._url.video_channel,
                sock=sock,
                ssl=trust() if self._url.secure else None,
                subprotocols=[Subprotocol(AGENT_VIDEO_SUBPROTOCOL)],
                additional_headers={"Authorization": f"Bearer {self._ticket}"},
                user_agent_header=f"tower-agent/{VERSION}",
                compression=None,
                proxy=None,
                open_timeout=OPEN_WITHIN_S,
                ping_interval=None,  # the tower answers each unit
                close_timeout=CLOSE_WITHIN_S,
                max_size=MAX_ANSWER_BYTES,
                write_limit=WRITE_BUFFER_BYTES,
            )
        except BaseException:
            sock.close()
            raise

    async def _serve(self, connection: ClientConnection) -> None:
        self._begin_on(str(connection.local_address[0]))
        self._units.clear()
        self._connection, self.words = connection, ""
        _log.info("video: the channel to the tower is open")
        self._opened()
        writing = asyncio.create_task(self._write(connection))
        probing = asyncio.create_task(self._probe_for_loss(connection))
        try:
            await self._read(connection)
            self._memory.forget()  # the connection broke; a close for lack of viewers does not get here
        finally:
            self._connection = None
            for task in (writing, probing):
                task.cancel()
            await asyncio.gather(writing, probing, return_exceptions=True)
            await connection.close()
            self._failed(f"the video channel has ended ({connection.close_code} {connection.close_reason or ''})")

    def _begin_on(self, local: str) -> None:
        now = time.monotonic()
        if local == self._local:
            self._rate.reconnected(now)
        else:
            self._rate.begin(now, self._memory.recall(local, now))
        self._local = local

    async def _probe_for_loss(self, connection: ClientConnection) -> None:
        """Sends small pings while an answer is overdue (LinkRate.is_overdue)."""
        with contextlib.suppress(ConnectionClosed):
            while True:
                await asyncio.sleep(LOSS_PROBE_EVERY_S)
                if self._rate.is_overdue(time.monotonic()):
                    await connection.ping()

    async def _write(self, connection: ClientConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                while self._units:
                    unit = self._units.popleft()
                    piece = piece_bytes(unit.sent.pacing_bps)
                    if len(unit.message) <= piece:
                        await _sleep_until(unit.sent.begins_at)
                        await connection.send(unit.message)
                    else:
                        await connection.send(_pieces(unit, piece))
                self._more.clear()
                await self._more.wait()

    async def _read(self, connection: ClientConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            async for message in connection:
                try:
                    if isinstance(message, bytes):
                        self._rate.got(decode_got(message), time.monotonic())
                    else:
                        request = _key_requests.decode(message)
                        self._key_wanted(StreamRequest(request.quality, request.codec))
                except (MalformedUnit, msgspec.DecodeError) as error:
                    _log.warning("video: the tower said what cannot be understood: %s", error)
                    await connection.close(1008, "malformed message")


async def _pieces(unit: Departure, size: int) -> AsyncIterator[bytes]:
    """Yields the fragments of one message, each at its time."""
    at = unit.sent.begins_at
    for begin in range(0, len(unit.message), size):
        await _sleep_until(at)
        piece = unit.message[begin : begin + size]
        at += wire_bits(len(piece)) / unit.sent.pacing_bps
        yield piece


async def _sleep_until(at: float) -> None:
    wait_s = at - time.monotonic()
    if wait_s > 0.0005:
        await asyncio.sleep(wait_s)


def prepare(sock: socket.socket) -> None:
    """Gives the pictures the lowest priority, and makes TCP use a recovered line at once."""
    waits_for_others(sock)
    with contextlib.suppress(OSError):
        sock.setsockopt(socket.IPPROTO_TCP, _TCP_THIN_LINEAR_TIMEOUTS, 1)
