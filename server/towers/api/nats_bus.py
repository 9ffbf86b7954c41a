"""The connection to NATS: packets out, packets in. Knows nothing of what they say.

Nothing waits for a connection: what cannot go now is dropped, and the streams above notice.
"""

from __future__ import annotations

import asyncio
import ssl
import time
from collections import deque
from collections.abc import Callable, Coroutine, Sequence
from pathlib import Path
from typing import Any, Final

import structlog
from nats.aio.client import Client
from nats.aio.msg import Msg
from nats.errors import Error as NatsError

from server.runtime.vault import VaultError
from server.towers.io.bus_seal import SENDER_BYTES, BusSeal, NotOfATower
from server.towers.io.bus_unavailable import BusUnavailable

CONNECT_WITHIN_S: Final = 2.0
OPEN_WITHIN_S: Final = 5.0
"""At the start of the tower."""
CANCEL_EVERY_S: Final = 0.1
PING_EVERY_S: Final = 1
MAX_WAITING_BYTES: Final = 1_000_000
"""Beyond it packets are dropped, which breaks the stream: a bus that takes nothing must not look alive."""
HIGH_WATER_BYTES: Final = 200_000
"""From here on state waits in the outboxes of visitors, where a newer frame takes the place of an older one.
Pictures are left out."""
PREFIX: Final = "control-tower"
LOG_EVERY_S: Final = 60.0
_log = structlog.get_logger(__name__)


async def _within(work: Coroutine[Any, Any, None], limit_s: float) -> None:
    """Raises TimeoutError if the work does not end in time. Cancels it until it has ended: the library waits with
    `asyncio.wait_for`, which in Python 3.11 loses a cancellation that comes with its result. It then tries for ever."""
    running = asyncio.create_task(work)
    try:
        await asyncio.wait({running}, timeout=limit_s)
        is_late = not running.done()
    finally:
        while not running.done():
            running.cancel()
            await asyncio.wait({running}, timeout=CANCEL_EVERY_S)
    if is_late and running.cancelled():
        raise TimeoutError(f"no answer within {limit_s:g} s")
    await running


class NatsBus:
    """One connection of one tower. `on_packet` is called for each packet to `me`. `prefix`: of the subjects.
    `gives_way`: lets everything else have its turn after each packet. `authority`: certificates in PEM to believe
    instead of the system's. `keys`: with which towers seal what they say (`bus_seal.py`)."""

    def __init__(
        self,
        url: str,
        me: str,
        *,
        on_packet: Callable[[bytes], None],
        keys: Callable[[], Sequence[bytes]],
        prefix: str = PREFIX,
        gives_way: bool = False,
        authority: Path | None = None,
    ) -> None:
        self._url = url
        self._authority = authority
        self._me = me
        self._prefix = prefix
        self._gives_way = gives_way
        self._on_packet = on_packet
        self._seal = BusSeal(me, keys, prefix)
        self.is_older: Callable[[str], bool] = lambda tower: False
        """Whether this tower is of a version that seals nothing, as the database says."""
        self.refused = 0
        """Packets that were not of a tower, or repeated."""
        self._refusal_logged_at = float("-inf")
        self._client: Client | None = None
        self._waiting: deque[tuple[str, bytes]] = deque()
        self._waiting_bytes = 0
        self._something = asyncio.Event()
        self._sending: asyncio.Task[None] | None = None
        self.dropped = 0

    @property
    def is_connected(self) -> bool:
        return self._client is not None and self._client.is_connected

    def has_room(self) -> bool:
        """False while NATS does not take what waits."""
        return self._waiting_bytes < HIGH_WATER_BYTES

    async def open(self) -> None:
        """Raises BusUnavailable."""
        try:
            trust = ssl.create_default_context(cafile=self._authority) if self._authority else None
        except OSError as error:
            raise BusUnavailable(f"TOWER_BUS_AUTHORITY cannot be read: {error}") from error
        client = Client()
        pause_s: Any = 0.2  # the library waits for fractions too
        problem: Exception | None = None

        async def failed(error: Exception) -> None:
            nonlocal problem
            if problem is None or isinstance(error, NatsError):  # what NATS says, before a pipe that it broke
                problem = error
            await _failed(error)

        async def connect() -> None:
            await client.connect(
                self._url,
                tls=trust,
                connect_timeout=round(CONNECT_WITHIN_S),
                allow_reconnect=True,
                max_reconnect_attempts=-1,
                reconnect_time_wait=pause_s,
                ping_interval=PING_EVERY_S,
                max_outstanding_pings=2,
                pending_size=MAX_WAITING_BYTES,
                disconnected_cb=self._disconnected,
                reconnected_cb=self._reconnected,
                error_cb=failed,
                no_echo=True,
                name=f"{self._prefix} {self._me[:8]}",
            )
            await client.subscribe(f"{self._prefix}.{self._me}", cb=self._received)
            await client.flush(timeout=round(CONNECT_WITHIN_S))

        try:
            # The library tries for ever, also with a wrong password or certificate.
            await _within(connect(), OPEN_WITHIN_S)
        except (NatsError, OSError, TimeoutError) as error:
            await client.close()
            raise BusUnavailable(f"the bus (TOWER_BUS_URL) does not let this tower in: {problem or error}") from error
        self._client = client
        self._sending = asyncio.create_task(self._send())

    def publish(self, tower: str, packet: bytes) -> None:
        """Sends soon, or drops it."""
        if not self.is_older(tower):
            packet = self._seal.seal(packet, tower)
        if not self.is_connected or self._waiting_bytes + len(packet) > MAX_WAITING_BYTES:
            self.dropped += 1
            return
        self._waiting.append((f"{self._prefix}.{tower}", packet))
        self._waiting_bytes += len(packet)
        self._something.set()

    async def close(self) -> None:
        if self._sending is not None:
            self._sending.cancel()
            await asyncio.gather(self._sending, return_exceptions=True)
        if self._client is not None:
            await self._client.close()
            self._client = None

    async def _send(self) -> None:
        assert self._client is not None
        while True:
            await self._something.wait()
            self._something.clear()
            while self._waiting:
                subject, packet = self._waiting.popleft()
                self._waiting_bytes -= len(packet)
                try:
                    await self._client.publish(subject, packet)
                except (NatsError, OSError):
                    self.dropped += 1

    async def _received(self, message: Msg) -> None:
        packet = self._opened(message.data)
        if packet is not None:
            self._on_packet(packet)
        if self._gives_way:
            await asyncio.sleep(0)

    def _opened(self, data: bytes) -> bytes | None:
        if self.is_older(data[:SENDER_BYTES].hex()):
            return data
        try:
            return self._seal.open(data)
        except (NotOfATower, VaultError) as error:
            self.refused += 1
            now = time.monotonic()
            if now - self._refusal_logged_at > LOG_EVERY_S:
                self._refusal_logged_at = now
                _log.error("bus_packet_refused", connection=self._prefix, why=str(error), refused=self.refused)
            return None

    def forget(self, tower: str) -> None:
        """It has ended."""
        self._seal.forget(tower)

    async def _disconnected(self) -> None:
        _log.error("bus_lost", connection=self._prefix)
        self._waiting.clear()
        self._waiting_bytes = 0

    async def _reconnected(self) -> None:
        _log.info("bus_back", connection=self._prefix)


async def _failed(error: Exception) -> None:
    """Each failed attempt to connect again: `bus_lost` and `bus_back` have said it already."""
    _log.debug("bus_failed", error=type(error).__name__)
