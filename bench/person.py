"""A user at a console: signed in, with a live channel, answers to pings, and sticks at 50 Hz."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import httpx
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from wire.dialect import build, mavlink
from wire.ids import DroneId
from wire.lateness import stamp_ms
from wire.tagged import stamp, tag

STICKS_S = 0.02
GCS_SYSTEM, GCS_COMPONENT = 255, 190
Event = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Sticks:
    """MANUAL_CONTROL; centred by default."""

    x: int = 0
    y: int = 0
    z: int = 500
    r: int = 0


class Refused(Exception):
    """The tower refused a request."""


class Person:
    def __init__(self, name: str, mark: int, address: str, drone_id: int) -> None:
        """`mark`: the `buttons` of their sticks, by which the tap recognizes them."""
        self.name = name
        self._mark = mark
        self._drone_id = drone_id
        self._address = address
        # Short enough that the tower does not close a connection just as it is used again.
        limits = httpx.Limits(keepalive_expiry=2.0)
        self.http = httpx.AsyncClient(base_url=f"{address}/api/v1", timeout=15, limits=limits)
        self._loop = asyncio.get_running_loop()
        self._socket: ClientConnection | None = None
        self._tasks: list[asyncio.Task[None]] = []
        self.sticks: Sticks | None = None
        """Sent 50 times per second; None: nothing."""
        self.pong_delay_s = 0.0
        self.answered_at = 0.0
        """When the last response arrived."""
        self.heard_at = 0.0
        """When the last message of the live channel arrived."""
        self.events: list[tuple[float, Event]] = []
        self._news = asyncio.Event()
        self._sequence = 0

    @property
    def now(self) -> float:
        return self._loop.time()

    async def sign_in(self, password: str) -> None:
        answer = await self.http.post("/session", json={"name": self.name, "password": password})
        answer.raise_for_status()

    async def go_live(self) -> None:
        began_at = self.now
        cookie = "; ".join(f"{name}={value}" for name, value in self.http.cookies.items())
        self._socket = await connect(
            self._address.replace("http", "ws", 1) + "/api/v1/live",
            subprotocols=[Subprotocol("tower.v1")],
            additional_headers={"Cookie": cookie, "Origin": self._address},
            compression=None,
            max_size=None,
        )
        self._tasks = [asyncio.ensure_future(one) for one in (self._listen(self._socket), self._stream(self._socket))]
        await self.until(lambda event: event["type"] == "welcome", since=began_at)

    def is_live(self, silent_s: float) -> bool:
        """Whether the live channel is open and not silent for so long."""
        open_now = self._socket is not None and bool(self._tasks) and not self._tasks[0].done()
        return open_now and self.now - self.heard_at < silent_s

    async def vanish(self) -> None:
        """Closes the socket without a WebSocket close, as when a laptop lid closes."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._tasks = []
        if self._socket is not None:
            self._socket.transport.abort()
            self._socket = None

    async def close(self) -> None:
        await self.vanish()
        await self.http.aclose()

    async def _listen(self, socket: ClientConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            async for message in socket:
                self.heard_at = self.now
                if isinstance(message, bytes):
                    continue
                event = json.loads(message)
                if event["type"] == "ping":
                    answer = json.dumps({"type": "pong", "sequence": event["sequence"]})
                    self._loop.call_later(self.pong_delay_s, self._send_soon, socket, answer)
                    continue
                self.events.append((self.now, event))
                self._news.set()

    def _send_soon(self, socket: ClientConnection, words: str) -> None:
        async def send() -> None:
            with contextlib.suppress(ConnectionClosed):
                await socket.send(words)

        self._tasks.append(asyncio.ensure_future(send()))
        self._tasks = [task for task in self._tasks if not task.done()]

    async def _stream(self, socket: ClientConnection) -> None:
        due = self.now
        with contextlib.suppress(ConnectionClosed):
            while True:
                if self.sticks is not None:
                    s = self.sticks
                    await self.send(mavlink.MAVLink_manual_control_message(1, s.x, s.y, s.z, s.r, self._mark))
                due = max(due + STICKS_S, self.now)
                await asyncio.sleep(due - self.now)

    async def send(self, message: Any) -> None:
        assert self._socket is not None
        self._sequence += 1
        frame = build(message, system_id=GCS_SYSTEM, component_id=GCS_COMPONENT, sequence=self._sequence)
        await self._socket.send(stamp(stamp_ms(self.now)) + tag(DroneId(self._drone_id), frame))

    async def command(self, number: int, *params: float) -> None:
        seven = (*params, *([0.0] * (7 - len(params))))
        await self.send(mavlink.MAVLink_command_long_message(1, 1, number, 0, *seven))

    async def ask(self, method: str, path: str, body: Any = None) -> Any:
        answer = await self.http.request(method, path, json=body)
        self.answered_at = self.now
        if answer.status_code >= 400:
            raise Refused(f"{self.name}: {method} {path}: {answer.status_code} {answer.text[:400]}")
        return answer.json() if answer.content else None

    async def control(self, verb: str, **body: Any) -> Any:
        return await self.ask("POST", f"/drones/{self._drone_id}/control/{verb}", {"reason": "bench", **body})

    async def drone(self) -> Any:
        return await self.ask("GET", f"/drones/{self._drone_id}")

    async def until(
        self, wanted: Callable[[Event], bool], *, since: float, timeout_s: float = 15.0
    ) -> tuple[float, Event]:
        """Returns the first wanted event after `since`, with its arrival time. Raises TimeoutError."""
        looked = 0
        async with asyncio.timeout(timeout_s):
            while True:
                self._news.clear()
                for at, event in self.events[looked:]:
                    if at >= since and wanted(event):
                        return at, event
                looked = len(self.events)
                await self._news.wait()

    async def until_hold(self, *, since: float, timeout_s: float = 15.0) -> tuple[float, Event]:
        """Returns the step that ends a hold: confirmed, or not needed."""
        return await self.until(
            lambda event: (
                event["type"] == "hold"
                and event["drone_id"] == self._drone_id
                and event["step"] in ("confirmed", "not_needed")
            ),
            since=since,
            timeout_s=timeout_s,
        )
