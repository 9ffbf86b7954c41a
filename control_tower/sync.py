"""The same for programs without asyncio: every method waits.

    with sync.Tower("https://tower.example.org", token) as tower, tower.drone("Kestrel").fly() as flight:
        flight.take_off(10)

The connection lives in a thread of its own, so that a program that computes keeps the controls. It ends with the thread
that opened it: a program that is gone must not count as a pilot. A loss reaches the program at its next call, and at
the end of the `with` block at the latest.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import threading
from collections.abc import Callable, Coroutine, Iterator
from types import TracebackType
from typing import Any, Final, Self, TypeVar

from control_tower import drone as asynchronous
from control_tower import flight as flights
from control_tower import tower as towers
from control_tower.drone import AtError, Measure
from control_tower.errors import ControlLost, TowerError
from control_tower.events import Event
from control_tower.streams import Closed, Stream
from control_tower.values import DroneState, Operation, Telemetry, User

T = TypeVar("T")
OWNER_CHECK_S: Final = 0.5


class _Loop:
    """An event loop in a thread. It stops when the thread that made it has ended."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._owner = threading.current_thread()
        self._thread = threading.Thread(target=self._run, name="control-tower", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.call_later(OWNER_CHECK_S, self._check_owner)
        try:
            self._loop.run_forever()
        finally:
            for task in asyncio.all_tasks(self._loop):
                task.cancel()
            self._loop.run_until_complete(asyncio.sleep(0))
            self._loop.close()

    def _check_owner(self) -> None:
        if self._owner.is_alive():
            self._loop.call_later(OWNER_CHECK_S, self._check_owner)
        else:
            self._loop.stop()

    def wait(self, work: Coroutine[Any, Any, T]) -> T:
        """Runs it there. Ctrl-C here cancels it there."""
        future = asyncio.run_coroutine_threadsafe(work, self._loop)
        try:
            return future.result()
        except BaseException:
            future.cancel()
            raise

    def stop(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()


class Tower:
    """As `control_tower.Tower`, a plain context manager."""

    def __init__(self, address: str = "", token: str = "", *, rate_hz: float = 10.0) -> None:
        self._tower = towers.Tower(address, token, rate_hz=rate_hz)

    def __enter__(self) -> Self:
        self._loop = _Loop()
        try:
            self._loop.wait(self._tower.__aenter__())
        except BaseException:
            self._loop.stop()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._loop.wait(self._tower.__aexit__(kind, error, trace))
        finally:
            self._loop.stop()

    @property
    def user(self) -> User:
        return self._tower.user

    @property
    def drones(self) -> list[Drone]:
        return [Drone(self._loop, one) for one in self._tower.drones]

    def drone(self, which: str | int) -> Drone:
        """Raises KeyError with the names there are."""
        return Drone(self._loop, self._tower.drone(which))

    def events(self) -> contextlib.AbstractContextManager[Iterator[Event]]:
        return _stream(self._loop, self._tower.events)

    def request(self, method: str, path: str, body: Any = None) -> Any:
        return self._loop.wait(self._tower.request(method, path, body))


class Drone:
    """As `control_tower.Drone`."""

    def __init__(self, loop: _Loop, drone: asynchronous.Drone) -> None:
        self._loop = loop
        self._drone = drone
        self.id = drone.id

    @property
    def name(self) -> str:
        return self._drone.name

    @property
    def state(self) -> DroneState:
        return self._drone.state

    @property
    def telemetry(self) -> Telemetry:
        return self._drone.telemetry

    def watch(self) -> contextlib.AbstractContextManager[Iterator[Telemetry]]:
        return _stream(self._loop, self._drone.watch)

    def events(self) -> contextlib.AbstractContextManager[Iterator[Event]]:
        return _stream(self._loop, self._drone.events)

    def mission(self, *, fresh: bool = False) -> list[Any]:
        return self._loop.wait(self._drone.mission(fresh=fresh))

    def effects(self) -> dict[Measure, str]:
        return self._loop.wait(self._drone.effects())

    def restrain(self, measure: Measure, reason: str = "", *, confirmed: bool = False) -> None:
        self._loop.wait(self._drone.restrain(measure, reason, confirmed=confirmed))

    def unrestrain(self) -> None:
        self._loop.wait(self._drone.unrestrain())

    def request(self, method: str, path: str, body: Any = None) -> Any:
        return self._loop.wait(self._drone.request(method, path, body))

    @contextlib.contextmanager
    def fly(
        self, *, take: bool = False, at_error: AtError | None = "rtl", offline_s: float = asynchronous.OFFLINE_S
    ) -> Iterator[Flight]:
        """As `control_tower.Drone.fly`. After a loss the next call raises ControlLost, and so does the end."""
        begun = self._drone.begin_flight(take=take, offline_s=offline_s)
        inner = self._loop.wait(begun.__aenter__())
        failed = True
        try:
            yield Flight(self._loop, inner)
            failed = False
        finally:
            self._loop.wait(_end(begun, inner, failed, at_error))
        if inner.loss is not None:
            raise ControlLost(inner.loss)


async def _end(
    begun: contextlib.AbstractAsyncContextManager[flights.Flight],
    flight: flights.Flight,
    failed: bool,
    at_error: AtError | None,
) -> None:
    await flight.finish(failed, at_error)
    await begun.__aexit__(None, None, None)


class Flight:
    """As `control_tower.Flight`."""

    def __init__(self, loop: _Loop, flight: flights.Flight) -> None:
        self._loop = loop
        self._flight = flight

    @property
    def state(self) -> DroneState:
        return self._flight.state

    @property
    def telemetry(self) -> Telemetry:
        return self._flight.telemetry

    def command(self, command: str, **members: Any) -> Operation:
        return self._wait(self._flight.command(command, **members))

    def arm(self) -> None:
        self._wait(self._flight.arm())

    def disarm(self) -> None:
        self._wait(self._flight.disarm())

    def mode(self, name: str) -> None:
        self._wait(self._flight.mode(name))

    def take_off(self, height_m: float, *, timeout_s: float = 120.0) -> None:
        self._wait(self._flight.take_off(height_m, timeout_s=timeout_s))

    def go_to(
        self,
        lat_deg: float,
        lon_deg: float,
        height_m: float,
        *,
        speed_m_s: float | None = None,
        heading_deg: float | None = None,
        within_m: float = flights.NEAR_M,
        timeout_s: float = flights.ARRIVE_WITHIN_S,
    ) -> None:
        going = self._flight.go_to(
            lat_deg,
            lon_deg,
            height_m,
            speed_m_s=speed_m_s,
            heading_deg=heading_deg,
            within_m=within_m,
            timeout_s=timeout_s,
        )
        self._wait(going)

    def hold(self) -> None:
        self._wait(self._flight.hold())

    def pause(self) -> None:
        self._wait(self._flight.pause())

    def resume(self) -> None:
        self._wait(self._flight.resume())

    def speed(self, m_s: float) -> None:
        self._wait(self._flight.speed(m_s))

    def servo(self, number: int, pulse_us: int) -> None:
        self._wait(self._flight.servo(number, pulse_us))

    def grab(self, gripper: int = 1) -> None:
        self._wait(self._flight.grab(gripper))

    def release(self, gripper: int = 1) -> None:
        self._wait(self._flight.release(gripper))

    def turn(self, deg: float, *, relative: bool = False) -> None:
        self._wait(self._flight.turn(deg, relative=relative))

    def land(self, *, timeout_s: float = flights.ARRIVE_WITHIN_S) -> None:
        self._wait(self._flight.land(timeout_s=timeout_s))

    def return_home(self, *, timeout_s: float = flights.ARRIVE_WITHIN_S) -> None:
        self._wait(self._flight.return_home(timeout_s=timeout_s))

    def upload_mission(self, items: list[Any], *, while_flying: bool = False) -> Operation:
        return self._wait(self._flight.upload_mission(items, while_flying=while_flying))

    def start_mission(self, item: int = 0, *, as_it_is: bool = False) -> None:
        self._wait(self._flight.start_mission(item, as_it_is=as_it_is))

    def until_disarmed(self, *, timeout_s: float = 3600.0) -> None:
        self._wait(self._flight.until_disarmed(timeout_s=timeout_s))

    def until(
        self, condition: Callable[[Telemetry], bool], what: str, *, timeout_s: float = flights.ARRIVE_WITHIN_S
    ) -> Telemetry:
        return self._wait(self._flight.until(condition, what, timeout_s=timeout_s))

    def loss_check(self) -> list[str]:
        return self._wait(self._flight.loss_check())

    def acknowledge_loss_check(self) -> None:
        self._wait(self._flight.acknowledge_loss_check())

    def _wait(self, work: Coroutine[Any, Any, T]) -> T:
        try:
            return self._loop.wait(work)
        except concurrent.futures.CancelledError:
            if self._flight.loss is None:
                raise
            raise ControlLost(self._flight.loss) from None


@contextlib.contextmanager
def _stream(loop: _Loop, opened: Callable[[], contextlib.AbstractContextManager[Stream[T]]]) -> Iterator[Iterator[T]]:
    async def enter() -> tuple[contextlib.AbstractContextManager[Stream[T]], Stream[T]]:
        manager = opened()
        return manager, manager.__enter__()

    async def leave() -> None:
        manager.__exit__(None, None, None)

    manager, stream = loop.wait(enter())
    try:
        yield _values(loop, stream)
    finally:
        with contextlib.suppress(TowerError):
            loop.wait(leave())


def _values(loop: _Loop, stream: Stream[T]) -> Iterator[T]:
    async def following() -> T:
        return await anext(stream)

    while True:
        try:
            yield loop.wait(following())
        except Closed:
            return
