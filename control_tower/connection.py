"""The connection with a tower: REST for requests, one WebSocket for telemetry, events and presence. Thin shell.

The socket watches only, until something flies. Then it is opened again with all that the token allows, and its answers
to the tower's pings keep the controls alive.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
from collections.abc import AsyncIterator, Callable, Iterator
from typing import Any, Final

import msgspec

from connect.live import Live
from connect.rest import Rest
from connect.tower_url import parse_tower_url
from connect.unusable import TowerAway, Unusable
from control_tower.errors import OperationFailed, Refused, SignInRefused, TowerError, TowerUnreachable
from control_tower.events import Connected, DroneChanged, DroneRemoved, Event, OperationChanged, StatusText, parse
from control_tower.streams import Closed, Stream
from control_tower.telemetry import TelemetryReader
from control_tower.values import DroneState, Operation, Telemetry, User
from wire.frames import MalformedFrame
from wire.tagged import split_tagged

OPEN_WITHIN_S: Final = 15.0
ASK_AGAIN_S: Final = 2.0
"""How often an operation is looked up in case its last event was missed."""
IN_TURN_WITHIN_S: Final = 2.0
"""A request waits for the tower's answer to the one before it about the same drone, for no longer than this."""
MAX_ENDED: Final = 256
"""Operations whose end is remembered: an event may come before the answer to the request that began it."""


class Connection:
    """One user's connection with one tower. `open` it, and `close` it. The parameters are those of `Tower`."""

    def __init__(self, address: str = "", token: str = "", *, rate_hz: float = 10.0) -> None:
        try:
            self._url = parse_tower_url(address or os.environ.get("TOWER_URL", ""))
        except Unusable as error:
            raise SignInRefused(str(error)) from None
        token = (token or os.environ.get("TOWER_TOKEN", "")).strip()
        if not token:
            raise SignInRefused("an API token is needed: pass it, or set TOWER_TOKEN (docs/tokens.md)")
        self._token = token
        self._rate_hz = rate_hz
        self._rest = Rest(self._url, token)
        self._user: User | None = None
        self.states: dict[int, DroneState] = {}
        """The squad, by id."""
        self._readers: dict[int, TelemetryReader] = {}
        self._watchers: list[tuple[int, Stream[Telemetry]]] = []
        self._events: list[tuple[int | None, Stream[Event]]] = []
        self._ended: dict[str, Operation] = {}
        self._changed = asyncio.Event()
        self._beginning: dict[str, asyncio.Task[Any]] = {}
        """The last request that began an operation, by the drone's path."""
        self._flying = 0
        self._failure: TowerError | None = None

    async def open(self) -> None:
        """Signs in, and returns once the tower has sent its state. Raises SignInRefused or TowerUnreachable."""
        # The answer says whether the token is good; the socket alone would only retry.
        await self.request("GET", "/drones")
        self._live = Live(
            self._url,
            self._token,
            hello=[{"type": "watch", "rate_hz": self._rate_hz}],
            received=self._received,
            say=lambda _words: None,
            shut=self._shut,
        )
        self._running = asyncio.create_task(self._run())
        try:
            async with asyncio.timeout(OPEN_WITHIN_S):
                await self._until(lambda: self._user is not None)
        except TimeoutError:
            await self.close()
            raise TowerUnreachable(f"{self._url.origin} does not open the live channel") from None
        except BaseException:
            await self.close()
            raise

    async def close(self) -> None:
        """Ends every stream with `Closed`."""
        self._running.cancel()
        await asyncio.wait({self._running})
        self._end_streams(Closed("the connection was closed"))

    @property
    def user(self) -> User:
        """Who is signed in."""
        assert self._user is not None, "only inside `async with`"
        return self._user

    def telemetry(self, drone_id: int) -> Telemetry:
        """Returns the newest state of a drone."""
        return self._reader(drone_id).newest

    @contextlib.contextmanager
    def events(self, drone_id: int | None = None) -> Iterator[Stream[Event]]:
        """All events from now on, or those about one drone. The stream raises TooSlow if nobody reads it."""
        stream: Stream[Event] = Stream(newest_only=False)
        entry = (drone_id, stream)
        self._events.append(entry)
        try:
            yield stream
        finally:
            self._events.remove(entry)

    def system_id(self, drone_id: int) -> int:
        """Returns the MAVLink id of the drone's autopilot, to which sticks are addressed."""
        return self._reader(drone_id).system_id

    @contextlib.contextmanager
    def watch(self, drone_id: int) -> Iterator[Stream[Telemetry]]:
        """Each new state of a drone; a reader that is slow gets the newest only."""
        entry = (drone_id, Stream[Telemetry](newest_only=True))
        self._watchers.append(entry)
        try:
            yield entry[1]
        finally:
            self._watchers.remove(entry)

    async def request(self, method: str, path: str, body: Any = None, **headers: str) -> Any:
        """Sends a request of the REST API (docs/api.md); `path` is relative to `/api/v1`. Returns the parsed JSON.
        Raises Refused, TowerUnreachable or SignInRefused."""
        try:
            answer = await self._rest.ask(method, path, body, **headers)
        except TowerAway as error:
            raise TowerUnreachable(str(error)) from None
        except Unusable as error:
            raise SignInRefused(str(error)) from None
        if not answer.done:
            raise Refused(answer.status, answer.code, answer.words)
        return answer.body

    async def operate(self, method: str, path: str, body: Any = None) -> Operation:
        """Begins an operation and follows it to its end. Raises OperationFailed unless it is `done`. Cancelling this
        coroutine does not stop the operation."""
        return await self.follow(await self.begin(method, path, body))

    async def begin(self, method: str, path: str, body: Any = None) -> Operation:
        """Begins an operation, and returns when the tower has accepted the request. One at a time for a drone: a
        request whose caller was cancelled is on its way all the same, and must not arrive after the next one."""
        drone = "/".join(path.split("/")[:3])
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(IN_TURN_WITHIN_S):
                while (before := self._beginning.get(drone)) is not None and not before.done():
                    await asyncio.wait({before})
        asking = asyncio.create_task(self.request(method, path, body, Prefer="respond-async"))
        self._beginning[drone] = asking
        asking.add_done_callback(lambda task: task.cancelled() or task.exception())  # its caller may be gone
        return Operation.of(await asyncio.shield(asking))

    async def follow(self, operation: Operation) -> Operation:
        """Waits for the end. Raises OperationFailed unless it is `done`."""
        number = operation.id
        while not operation.over:
            try:
                async with asyncio.timeout(ASK_AGAIN_S):
                    await self._until(lambda: number in self._ended)
                operation = self._ended.pop(number)
            except TimeoutError:
                with contextlib.suppress(TowerUnreachable):
                    operation = Operation.of(await self.request("GET", f"/operations/{number}"))
        if operation.state != "done":
            raise OperationFailed(operation)
        return operation

    # For flights

    @property
    def may_fly(self) -> bool:
        """Whether the channel that proves the presence of a pilot is open."""
        return self._failure is None and self._live.may_fly

    @property
    def failure(self) -> TowerError | None:
        """Why the connection has ended for good."""
        return self._failure

    @contextlib.asynccontextmanager
    async def presence(self) -> AsyncIterator[None]:
        """Opens the live channel as one that may fly, for as long as it lasts."""
        self._flying += 1
        self._live.refresh()
        try:
            try:
                async with asyncio.timeout(OPEN_WITHIN_S):
                    while not self.may_fly:
                        if self._failure is not None:
                            raise self._failure
                        await asyncio.sleep(0.01)
            except TimeoutError:
                raise TowerUnreachable(f"{self._url.origin} does not open the live channel") from None
            yield
        finally:
            self._flying -= 1

    def send_frames(self, message: bytes) -> bool:
        """Sends a message of tagged frames now or never."""
        return self._live.send_frames(message)

    def video_connection(self, drone_id: int, query: str) -> tuple[str, dict[str, str], bool]:
        """Returns address, headers, and whether a proxy may be used, for a video channel."""
        origin = self._url.live(watch_only=True).partition("/live")[0]
        headers = {"Authorization": f"Bearer {self._token}"}
        return f"{origin}/drones/{drone_id}/video?{query}", headers, self._url.secure

    # What comes

    async def _run(self) -> None:
        try:
            await self._live.run(watch_only=lambda: not self._flying)
        except Unusable as error:
            self._fail(SignInRefused(str(error)))
        except Exception as error:  # a fault of this package must not leave programs waiting
            self._fail(TowerError(f"the live channel failed: {error!r}"))

    async def _shut(self, why: str) -> None:
        answer = await self._rest.ask("GET", "/drones")
        if not answer.done:
            raise Unusable(f"{self._url.origin} ended the connection: {why}")

    def _fail(self, error: TowerError) -> None:
        self._failure = error
        self._end_streams(error)
        self._changed.set()

    def _end_streams(self, error: TowerError) -> None:
        for _, events in self._events:
            events.end(error)
        for _, telemetry in self._watchers:
            telemetry.end(error)

    def _received(self, message: str | bytes) -> None:
        if isinstance(message, bytes):
            self._frames(message)
            return
        try:
            fields = msgspec.json.decode(message)
            kind = fields["type"]
            if kind == "ping":
                self._live.send_text({"type": "pong", "sequence": fields["sequence"]})
            elif kind == "welcome":
                self._welcome(fields)
            elif kind != "links":
                self._event(parse(fields))
        except (msgspec.DecodeError, KeyError, TypeError):
            return  # a tower of another version must not end a flight

    def _welcome(self, fields: dict[str, Any]) -> None:
        self._user = User.of(fields["user"])
        there = {drone["id"] for drone in fields["drones"]}
        for gone in [drone_id for drone_id in self.states if drone_id not in there]:
            self._event(DroneRemoved(gone))
        for drone in fields["drones"]:
            state = DroneState.of(drone)
            self._event(DroneChanged(state.id, state))
        self._event(Connected(None))

    def _frames(self, message: bytes) -> None:
        now = asyncio.get_running_loop().time()
        try:
            parts = split_tagged(message)
        except MalformedFrame:
            return
        for drone_id, frame in parts:
            if drone_id not in self.states:
                continue
            reader = self._reader(drone_id)
            if reader.take(frame, now):
                for watched, stream in self._watchers:
                    if watched == drone_id:
                        stream.put(reader.newest)
            while reader.texts:
                self._event(StatusText(drone_id, *reader.texts.pop(0)))

    def _event(self, event: Event) -> None:
        match event:
            case DroneChanged(state=state):
                self.states[state.id] = state
            case DroneRemoved(drone_id=int() as drone_id):
                gone = self.states.pop(drone_id, None)
                self._readers.pop(drone_id, None)
                for watched, stream in self._watchers:
                    if gone is not None and watched == drone_id:
                        stream.end(TowerError(f"{gone.name} is not in your squad any more"))
            case OperationChanged(operation=operation) if operation.over:
                if len(self._ended) >= MAX_ENDED:
                    self._ended.pop(next(iter(self._ended)))
                self._ended[operation.id] = operation
        for wanted, events in self._events:
            if wanted is None or wanted == event.drone_id:
                events.put(event)
        self._changed.set()

    def _reader(self, drone_id: int) -> TelemetryReader:
        return self._readers.setdefault(drone_id, TelemetryReader())

    async def _until(self, condition: Callable[[], bool]) -> None:
        """Waits for what an event brings. Raises why the connection has ended."""
        while not condition():
            if self._failure is not None:
                raise self._failure
            self._changed.clear()
            await self._changed.wait()
