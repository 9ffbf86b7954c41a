"""Runs the application on a listening socket: uvicorn, with the tower's own start and stop.

The application's lifespan is entered here and not by uvicorn, so that start-up errors arrive as the original
exceptions, and so that close messages are sent while connections are still open.
"""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Final

import uvicorn

from server.anonymous.api.acceptor import Acceptor
from server.anonymous.api.read_turns import ReadTurns
from server.anonymous.core.connections import AnonymousConnection
from server.app.standby import answering_standby
from server.app.tower import TowerApp
from server.link.api.websocket.direct_websocket import DirectWebSocket
from server.link.api.websocket.upgrading_http import UpgradingHttp
from server.runtime.aligned_timers import BEAT_S, rest
from server.runtime.garbage import settle_memory
from server.runtime.listening import address_in_words
from server.storage.database import LockLost
from server.storage.schema import check_schema

MAX_MESSAGE_BYTES: Final = 64 * 1024
"""Maximum size of a WebSocket message. The protocol allows 16 KiB upwards; the rest serves to report why a message was
refused."""
GRACE_S: Final = 2
ENDS_WITHIN_S: Final = 10.0
"""Deadline after the lock is lost. Work that hangs in an unreachable database must not keep the process alive."""
SWITCH_INTERVAL_S: Final = 0.0002
"""Maximum time for which another thread keeps the interpreter from the event loop. Python's default is 5 ms, as much as
a stick frame takes altogether. With 1 ms a stick took 1.9 ms beside somebody's long work, with this 1.0 ms, and the
work no longer (`python -m bench tenants`); a quarter of it changed nothing more."""
_TICKS_A_DAY: Final = 864_000


class TowerServer(uvicorn.Server):
    """One application on one socket. `started` (of uvicorn) is true once connections are accepted."""

    def __init__(
        self, app: TowerApp, *, on_listening: Callable[[], None] = lambda: None, standby: bool = False
    ) -> None:
        tower = app.tower
        super().__init__(
            uvicorn.Config(
                app,
                lifespan="off",
                http=UpgradingHttp,
                ws=DirectWebSocket,
                ws_max_size=MAX_MESSAGE_BYTES,
                ws_per_message_deflate=False,  # telemetry hardly shrinks, and every message would cost more
                timeout_graceful_shutdown=GRACE_S,
                proxy_headers=True,
                forwarded_allow_ips=tower.settings.trusted_proxies,
                access_log=False,
                log_config=None,
                server_header=False,
            )
        )
        self._app = app
        self._standby = standby
        self._lock = tower.lock
        self._on_listening = on_listening
        self._budget = tower.anonymous
        self._turns = ReadTurns(tower.anonymous)
        self._acceptors: list[Acceptor] = []

    async def run_on(self, listener: socket.socket) -> None:
        """Serves until stopped, then closes the socket. Raises the start-up errors of the application, and LockLost if
        another process has become the tower."""
        lock = self._lock
        lock.address = lock.address or address_in_words(listener)
        with listener:
            if self._standby and not await self._stand_by(listener):
                return
            lock.on_lost = self._fence
            if (several := self._app.tower.several) is not None:
                several.on_drained = self._drained
            async with self._app.router.lifespan_context(self._app):
                await self.serve(sockets=[listener])
        if lock.lost_words:
            raise LockLost(lock.lost_words)

    async def _stand_by(self, listener: socket.socket) -> bool:
        """Waits until this process has the lock. False if it was stopped before."""
        tower = self._app.tower
        await check_schema(tower.database)
        async with answering_standby(listener, self._app.version):
            taking = asyncio.create_task(self._lock.take(waits=True))
            try:
                while not taking.done() and not self.should_exit:
                    await asyncio.wait({taking}, timeout=BEAT_S)
            finally:
                taking.cancel()
                with suppress(asyncio.CancelledError):
                    await taking
        if self.should_exit:
            await self._lock.release()
            await tower.database.close()
        return not self.should_exit

    def _fence(self, _words: str) -> None:
        """Another process is the tower: closes every link at once, then ends this process, whatever is pending."""
        tower = self._app.tower
        tower.hub.close_all()
        self.should_exit = True
        last_resort = threading.Timer(ENDS_WITHIN_S, os._exit, (1,))
        last_resort.daemon = True
        last_resort.start()

    def _drained(self) -> None:
        self.should_exit = True

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leaves signals alone (see `run`): uvicorn would raise them again before the application has ended."""
        yield

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup([])  # without uvicorn's listener, which accepts all pending connections at once
        self._acceptors = [Acceptor(one, self._budget, self._connection) for one in sockets or ()]
        self._on_listening()

    def _connection(self, anonymous: AnonymousConnection) -> UpgradingHttp:
        return UpgradingHttp(
            config=self.config,
            server_state=self.server_state,
            app_state=self.lifespan.state,
            budget=self._budget,
            turns=self._turns,
            anonymous=anonymous,
        )

    async def main_loop(self) -> None:
        ticks = 0
        while not await self.on_tick(ticks):
            await rest(BEAT_S)
            ticks = (ticks + 1) % _TICKS_A_DAY

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        for say_goodbye in self._app.tower.before_shutdown:
            await say_goodbye()
        for acceptor in self._acceptors:
            acceptor.close()
        self._turns.close()
        await super().shutdown(sockets)


def run(app: TowerApp, listener: socket.socket, *, on_listening: Callable[[], None], standby: bool = False) -> None:
    """Runs in an event loop of its own until SIGINT or SIGTERM; a second SIGINT does not wait for connections.
    `standby`: first waits until no other process is the tower. Raises TowerLockHeld, LockLost."""

    def listening() -> None:
        settle_memory()
        on_listening()

    server = TowerServer(app, on_listening=listening, standby=standby)
    sys.setswitchinterval(SWITCH_INTERVAL_S)

    async def until_stopped() -> None:
        loop = asyncio.get_running_loop()
        for one in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(one, server.handle_exit, one, None)
        await server.run_on(listener)

    with asyncio.Runner(loop_factory=_loop_factory()) as runner:
        runner.run(until_stopped())


def _loop_factory() -> Callable[[], asyncio.AbstractEventLoop] | None:
    try:
        import uvloop
    except ImportError:  # not on every platform
        return None
    return uvloop.new_event_loop
