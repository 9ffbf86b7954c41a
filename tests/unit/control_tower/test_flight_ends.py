"""How a flight ends in a program: where it is cancelled, what is released, and what nothing hides."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Iterator
from typing import Any, cast

import pytest

from control_tower import ControlLost, Drone, Flight, LossCause, OperationFailed, Telemetry, User
from control_tower.connection import Connection
from control_tower.events import Event, HoldStep
from control_tower.streams import Stream
from control_tower.values import DroneState, Operation

ME = User(7, "alice")


class FakeTower:
    """A connection without a tower. Every drone flies, and belongs to alice as soon as she asks."""

    user = ME
    may_fly = True

    def __init__(self) -> None:
        self.states = {number: self._state(number) for number in (1, 2)}
        self.asked: list[str] = []
        self.told: list[tuple[int, str]] = []
        self.streams: list[tuple[int, Stream[Event]]] = []
        self.slow = asyncio.Event()
        self.slow.set()
        """Cleared: requests do not end."""
        self.refuses = False

    def _state(self, number: int) -> DroneState:
        return DroneState(number, f"d{number}", True, True, True, ME, 5, "owner", False, False, "")

    def hold(self, *drones: int) -> None:
        """All at the same moment."""
        for number, stream in self.streams:
            if number in drones:
                stream.put(HoldStep(number, 5, "ordered", "a helicopter", "order"))

    async def request(self, method: str, path: str, body: Any = None, **headers: str) -> Any:
        await self.slow.wait()
        self.asked.append(path)
        return {
            "id": int(path.split("/")[2]),
            "name": "d",
            "online": True,
            "epoch": 5,
            "holder": {"id": 7, "name": "a"},
        }

    async def operate(self, method: str, path: str, body: Any = None) -> Operation:
        self.told.append((int(path.split("/")[2]), body["command"]))
        done = Operation("1", 1, "command", "refused" if self.refuses else "done", "", "no", None, "", None)
        if self.refuses:
            raise OperationFailed(done)
        return done

    async def begin(self, method: str, path: str, body: Any = None) -> Operation:
        self.told.append((int(path.split("/")[2]), body["command"]))
        return Operation("1", 1, "command", "running", "", "", None, "", None)

    async def follow(self, operation: Operation) -> Operation:
        if self.refuses:
            raise OperationFailed(operation)
        await asyncio.Event().wait()  # it waits to see a speed
        raise AssertionError

    def telemetry(self, drone_id: int) -> Telemetry:
        return Telemetry()

    @contextlib.contextmanager
    def watch(self, drone_id: int) -> Iterator[Stream[Telemetry]]:
        self.watched = Stream[Telemetry](newest_only=True)
        yield self.watched

    @contextlib.contextmanager
    def events(self, drone_id: int) -> Iterator[Stream[Event]]:
        stream: Stream[Event] = Stream(newest_only=False)
        self.streams.append((drone_id, stream))
        yield stream

    @contextlib.asynccontextmanager
    async def presence(self) -> AsyncIterator[None]:
        yield

    def drone(self, number: int) -> Drone:
        return Drone(cast(Connection, self), number)

    def released(self) -> set[int]:
        return {int(path.split("/")[2]) for path in self.asked if path.endswith("/release")}


async def test_a_normal_end_releases_and_commands_nothing() -> None:
    tower = FakeTower()
    async with tower.drone(1).fly() as flight:
        await flight.hold()
    assert (tower.told, tower.released()) == ([(1, "hold")], {1})
    with pytest.raises(ControlLost, match="over"):
        await flight.hold()


async def test_a_hold_cancels_the_program_where_it_waits_and_nothing_hides_it() -> None:
    tower = FakeTower()
    caught: list[Exception] = []
    with pytest.raises(ControlLost, match="a helicopter") as lost:
        async with tower.drone(1).fly():
            asyncio.get_running_loop().call_later(0.01, tower.hold, 1)
            while True:
                try:
                    await asyncio.Event().wait()
                except Exception as error:
                    caught.append(error)
    assert lost.value.loss.cause is LossCause.HELD
    assert (caught, tower.told, tower.released()) == ([], [], {1})
    task = asyncio.current_task()
    assert task is not None
    assert task.cancelling() == 0
    await asyncio.sleep(0)  # nothing is cancelled behind it


async def test_a_program_that_hides_the_cancellation_is_told_at_the_end() -> None:
    tower = FakeTower()
    with pytest.raises(ControlLost):
        async with tower.drone(1).fly() as flight:
            asyncio.get_running_loop().call_later(0.01, tower.hold, 1)
            with contextlib.suppress(asyncio.CancelledError):
                await asyncio.Event().wait()
            with pytest.raises(ControlLost):
                await flight.mode("AUTO")
    assert tower.told == []


async def test_tasks_that_fly_it_are_cancelled_too() -> None:
    tower = FakeTower()

    async def wait_for_ever(flight: Flight) -> None:
        await flight.until(lambda now: False, "anything")

    with pytest.raises(ControlLost):
        async with tower.drone(1).fly() as flight:
            working = asyncio.create_task(wait_for_ever(flight))
            await asyncio.sleep(0.01)
            tower.hold(1)
            await asyncio.Event().wait()
    await asyncio.wait({working}, timeout=30)
    assert working.cancelled()


@pytest.mark.parametrize("held", [(1,), (2,), (1, 2), (2, 1)])
async def test_the_loss_of_one_ends_all_of_the_task_and_every_drone_is_released(held: tuple[int, ...]) -> None:
    tower = FakeTower()
    with pytest.raises(ControlLost):
        async with contextlib.AsyncExitStack() as controls:
            flights = [await controls.enter_async_context(tower.drone(number).fly()) for number in (1, 2)]
            asyncio.get_running_loop().call_later(0.01, tower.hold, *held)
            await asyncio.gather(*(flight.until(lambda now: False, "anything") for flight in flights))
    assert tower.released() == {1, 2}
    assert tower.told == [(number, "rtl") for number in (1, 2) if number not in held], "the others come home"
    task = asyncio.current_task()
    assert task is not None
    assert task.cancelling() == 0


async def test_a_second_loss_does_not_interrupt_the_release_of_the_first() -> None:
    tower = FakeTower()

    async def program() -> None:
        async with tower.drone(1).fly(), tower.drone(2).fly():
            await asyncio.Event().wait()

    task = asyncio.create_task(program())
    await asyncio.sleep(0.01)
    tower.slow.clear()
    tower.hold(2)
    await asyncio.sleep(0.02)
    tower.hold(1)
    await asyncio.sleep(0.02)
    tower.slow.set()
    with pytest.raises(ControlLost):
        await asyncio.wait_for(task, 30)
    assert tower.released() == {1, 2}


@pytest.mark.parametrize("refuses", [False, True])
async def test_an_error_in_the_air_commands_and_releases(refuses: bool) -> None:
    tower = FakeTower()
    tower.refuses = refuses
    with pytest.raises(ZeroDivisionError):
        async with tower.drone(1).fly(at_error="land"):
            raise ZeroDivisionError
    assert (tower.told, tower.released()) == ([(1, "land")], {1})


async def test_a_cancelled_program_stays_cancelled() -> None:
    tower = FakeTower()

    async def program() -> None:
        async with tower.drone(1).fly():
            await asyncio.Event().wait()

    task = asyncio.create_task(program())
    await asyncio.sleep(0.01)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert (tower.told, tower.released()) == ([(1, "rtl")], {1})


async def test_an_end_of_the_connection_ends_the_flight_without_a_release() -> None:
    tower = FakeTower()
    with pytest.raises(ControlLost) as lost:
        async with tower.drone(1).fly():
            tower.streams[0][1].end(RuntimeError("the token was revoked"))
            await asyncio.Event().wait()
    assert lost.value.loss.cause is LossCause.SIGNED_OUT
    assert tower.released() == set()


async def test_a_way_ends_on_arrival_even_while_the_tower_waits_to_see_its_speed() -> None:
    tower = FakeTower()
    async with tower.drone(1).fly() as flight:
        going = asyncio.create_task(flight.go_to(47.0, 8.0, 20, speed_m_s=5))
        await asyncio.sleep(0.01)
        tower.watched.put(Telemetry(lat_deg=47.0, lon_deg=8.0, height_m=5.0))
        await asyncio.sleep(0.01)
        assert not going.done(), "it still climbs"
        tower.watched.put(Telemetry(lat_deg=47.0, lon_deg=8.00001, height_m=19.5))
        await asyncio.wait_for(going, 30)
    assert tower.told == [(1, "goto")]


async def test_a_way_that_the_drone_refuses_is_an_error_at_once() -> None:
    tower = FakeTower()
    tower.refuses = True
    with pytest.raises(OperationFailed):
        async with tower.drone(1).fly(at_error=None) as flight:
            await asyncio.wait_for(flight.go_to(47.0, 8.0, 20), 30)
    assert tower.released() == {1}
