"""The live channel: a WebSocket that is reopened as long as the tower accepts the user. Thin shell."""

import asyncio
import contextlib
import random
from collections.abc import Awaitable, Callable
from typing import Any, Final

import msgspec
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake, WebSocketException
from websockets.typing import Subprotocol

from connect.tower_url import TowerUrl
from connect.unusable import TowerAway

SUBPROTOCOL: Final = Subprotocol("tower.v1")
SIGNED_OUT: Final = 4401
NOT_ALLOWED: Final = 4403

FIRST_WAIT_S: Final = 0.25
MAX_WAIT_S: Final = 2.0
OPEN_WITHIN_S: Final = 10.0
STEADY_S: Final = 2.0
"""A connection that ends sooner counts as failed: so a tower that accepts and closes at once is not retried
constantly."""

CHECK_EVERY_S: Final = 0.5

MAX_WAITING: Final = 256
"""Messages queued for the socket: two seconds of sticks and a mission. Any beyond that are dropped."""

MAX_MESSAGE_BYTES: Final = 1 << 22


class Live:
    """`received` gets every message of the tower: text as str, frames as bytes. `shut` is called when the tower signs
    the user out, and raises if that is final."""

    def __init__(
        self,
        tower: TowerUrl,
        token: str,
        *,
        hello: list[dict[str, Any]],
        received: Callable[[str | bytes], None],
        say: Callable[[str], None],
        shut: Callable[[str], Awaitable[None]],
    ) -> None:
        self._tower = tower
        self._token = token
        self._hello = hello
        self._received = received
        self._say = say
        self._shut = shut
        self._outgoing: asyncio.Queue[str | bytes] = asyncio.Queue(MAX_WAITING)
        self._socket: ClientConnection | None = None
        self._watch_only = True
        self._recheck = asyncio.Event()

    @property
    def may_fly(self) -> bool:
        """Whether the socket is open, and for more than watching."""
        return self._socket is not None and not self._watch_only

    def refresh(self) -> None:
        """Call when the result of `watch_only` may have changed."""
        self._recheck.set()

    def send_text(self, message: dict[str, Any]) -> None:
        """Sends now or never."""
        self._put(msgspec.json.encode(message).decode())

    def send_frames(self, message: bytes) -> bool:
        """Sends now or never: nothing is queued for a tower that comes back later. Returns False if not sent."""
        return self._put(message)

    def _put(self, message: str | bytes) -> bool:
        if self._socket is None or self._outgoing.full():
            return False
        self._outgoing.put_nowait(message)
        return True

    async def run(self, *, watch_only: Callable[[], bool]) -> None:
        """Runs until cancelled, or until `received` or `shut` raises."""
        wait_s = 0.0
        lost = False
        loop = asyncio.get_running_loop()
        while True:
            self._watch_only = watch_only()
            opened_at = None
            try:
                async with self._opened() as socket:
                    opened_at = loop.time()
                    if lost:
                        self._say(f"connected with {self._tower.origin} again")
                    lost = False
                    await self._serve(socket, watch_only)
                    continue  # on purpose, to reconnect with other scopes
            except ConnectionClosed as closed:
                why = (closed.rcvd.reason if closed.rcvd else "") or "the connection was cut"
                if closed.rcvd is not None and closed.rcvd.code in (SIGNED_OUT, NOT_ALLOWED):
                    with contextlib.suppress(TowerAway):
                        await self._shut(why)
            except (OSError, TimeoutError, InvalidHandshake, WebSocketException) as error:
                why = str(error) or type(error).__name__
            if not lost:
                self._say(f"{self._tower.origin} is lost ({why}); trying on")
            lost = True
            if opened_at is not None and loop.time() - opened_at >= STEADY_S:
                wait_s = 0.0
            await asyncio.sleep(wait_s * random.uniform(0.5, 1.0))  # noqa: S311 - spreads, guards nothing
            wait_s = min(MAX_WAIT_S, wait_s * 2 or FIRST_WAIT_S)

    def _opened(self) -> connect:
        return connect(
            self._tower.live(watch_only=self._watch_only),
            subprotocols=[SUBPROTOCOL],
            additional_headers={"Authorization": f"Bearer {self._token}"},
            compression=None,
            proxy=True if self._tower.secure else None,
            open_timeout=OPEN_WITHIN_S,
            max_size=MAX_MESSAGE_BYTES,
            ping_interval=5,
            ping_timeout=5,
        )

    async def _serve(self, socket: ClientConnection, watch_only: Callable[[], bool]) -> None:
        self._outgoing = asyncio.Queue(MAX_WAITING)
        self._socket = socket
        parts = (self._read(socket), self._write(socket), self._until_other_scopes(watch_only))
        tasks = [asyncio.create_task(part) for part in parts]
        try:
            for message in self._hello:
                self.send_text(message)
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                await task
        finally:
            self._socket = None
            for task in tasks:
                task.cancel()
            with contextlib.suppress(Exception):
                await asyncio.gather(*tasks, return_exceptions=True)

    async def _read(self, socket: ClientConnection) -> None:
        while True:
            self._received(await socket.recv())

    async def _write(self, socket: ClientConnection) -> None:
        while True:
            await socket.send(await self._outgoing.get())

    async def _until_other_scopes(self, watch_only: Callable[[], bool]) -> None:
        while watch_only() == self._watch_only:
            self._recheck.clear()
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(CHECK_EVERY_S):
                    await self._recheck.wait()
