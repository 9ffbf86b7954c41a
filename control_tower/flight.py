"""A drone in the hands of a program. Thin shell around `FlightWatch`.

A command returns when its effect is there: the height reached, the place reached, the drone on the ground. The first
sign of a TAKE, a hold or a lost link cancels what the program does, as a timeout would, and the `fly` context raises
ControlLost. So no `except Exception` in a program can miss it.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Coroutine, Sequence
from typing import Any, Final, TypeVar

from control_tower.connection import Connection
from control_tower.errors import ControlLost, FlightTimeout, Refused, TowerError
from control_tower.events import Event
from control_tower.flight_watch import FlightWatch
from control_tower.geodesy import distance_m
from control_tower.sticks import Sticks
from control_tower.streams import Stream
from control_tower.values import DroneState, Loss, LossCause, Operation, Telemetry

CHECK_EVERY_S: Final = 0.1
ARRIVE_WITHIN_S: Final = 600.0
NEAR_M: Final = 2.0
"""Nearer than that a drone has arrived: its position is no better."""
HEIGHT_NEAR_M: Final = 1.5
END_WITHIN_S: Final = 5.0
T = TypeVar("T")


class Flight:
    """Made by `Drone.fly`. Every method raises ControlLost once the program does not fly the drone any more, Refused if
    the tower refuses, OperationFailed if the drone does, FlightTimeout if it does not get there."""

    def __init__(
        self,
        connection: Connection,
        drone_id: int,
        epoch: int,
        *,
        acquired: bool,
        expects_hold: bool,
        offline_s: float,
    ) -> None:
        self._connection = connection
        self._drone_id = drone_id
        self._acquired = acquired
        self._path = f"/drones/{drone_id}"
        self._watch = FlightWatch(drone_id, connection.user.id, epoch, offline_s=offline_s)
        if expects_hold:
            self._watch.expect_hold()
        self._owner: asyncio.Task[Any] | None = None
        self._workers: set[asyncio.Task[Any]] = set()
        self.loss: Loss | None = None
        """Why the program does not fly it any more; None while it does."""
        self.cancelled_owner = False
        self._over = False

    @property
    def state(self) -> DroneState:
        """The drone as the tower reported it last. Raises ControlLost if the user may not see it any more."""
        state = self._connection.states.get(self._drone_id)
        if state is None:
            raise ControlLost(Loss(LossCause.TAKEN, "the drone is not in your squad any more"))
        return state

    @property
    def telemetry(self) -> Telemetry:
        return self._connection.telemetry(self._drone_id)

    def own(self, task: asyncio.Task[Any] | None) -> None:
        """The task to cancel when the flight is lost."""
        self._owner = task

    async def watch(self, events: Stream[Event]) -> None:
        """Watches for what ends the flight, until cancelled."""
        loop = asyncio.get_running_loop()
        reading = asyncio.ensure_future(anext(events))
        try:
            while self.loss is None:
                await asyncio.wait({reading}, timeout=CHECK_EVERY_S)
                loss = None
                if reading.done():
                    if reading.exception() is None:
                        loss = self._watch.event(reading.result(), loop.time())
                        reading = asyncio.ensure_future(anext(events))
                    else:
                        loss = Loss(LossCause.SIGNED_OUT, str(reading.exception()))
                self._lose(loss or self._watch.check(loop.time(), tower_there=self._connection.may_fly))
        finally:
            reading.cancel()
            with contextlib.suppress(asyncio.CancelledError, Exception):
                await reading

    def _lose(self, loss: Loss | None) -> None:
        if loss is None or self._over or self.loss is not None:
            return
        self.loss = loss
        for task in self._workers - {self._owner}:
            task.cancel()
        if self._owner is not None:
            self.cancelled_owner = True
            self._owner.cancel()

    async def _work(self, work: Coroutine[Any, Any, T]) -> T:
        """Runs it as long as the program flies the drone."""
        if self.loss is not None or self._over:
            work.close()
            raise ControlLost(self.loss or Loss(LossCause.TAKEN, "this flight is over"))
        task = asyncio.current_task()
        assert task is not None
        self._workers.add(task)
        try:
            return await work
        finally:
            self._workers.discard(task)

    async def finish(self, failed: bool, at_error: str | None) -> None:
        """Ends it: after an error in the air with this command first. Releases the controls that it acquired."""
        lost, self._over = self.loss, True
        if lost is not None and not lost.still_holder:
            return
        with contextlib.suppress(TowerError, TimeoutError):
            async with asyncio.timeout(END_WITHIN_S):
                if failed and lost is None and at_error is not None and self.state.airborne is not False:
                    with contextlib.suppress(TowerError):
                        await self._connection.operate("POST", self._path + "/commands", {"command": at_error})
                if self._acquired:
                    await self._connection.request("POST", self._path + "/control/release", {})

    # Commands

    async def command(self, command: str, **members: Any) -> Operation:
        """Gives any command of docs/api.md, and returns when the autopilot has accepted it. Members that are None are
        left out."""
        body = {"command": command} | {name: value for name, value in members.items() if value is not None}
        return await self._work(self._connection.operate("POST", self._path + "/commands", body))

    async def arm(self) -> None:
        await self.command("arm")
        await self._seen(lambda now: now.armed is True, "armed", 10.0)

    async def disarm(self) -> None:
        """Refused in the air."""
        await self.command("disarm")
        await self._seen(lambda now: now.armed is False, "disarmed", 10.0)

    async def mode(self, name: str) -> None:
        """Changes to a flight mode of the autopilot, such as `LOITER` or `AUTO.LOITER`."""
        await self.command("mode", mode=name)

    async def take_off(self, height_m: float, *, timeout_s: float = 120.0, ready_s: float = 60.0) -> None:
        """Arms if necessary and climbs to this height above home. Waits up to `ready_s` for an autopilot that is still
        starting."""
        await self._ready(ready_s)
        await self.command("takeoff", height_m=height_m)
        await self._seen(
            lambda now: now.height_m is not None and now.height_m >= height_m - max(0.5, 0.05 * height_m),
            f"at {height_m:g} m",
            timeout_s,
        )

    async def go_to(
        self,
        lat_deg: float,
        lon_deg: float,
        height_m: float,
        *,
        speed_m_s: float | None = None,
        heading_deg: float | None = None,
        within_m: float = NEAR_M,
        timeout_s: float = ARRIVE_WITHIN_S,
    ) -> None:
        """Flies there and returns on arrival, `within_m` of the place and 1.5 m of the height above home."""

        def there(now: Telemetry) -> bool:
            return (
                now.place is not None
                and now.height_m is not None
                and distance_m(*now.place, lat_deg, lon_deg) <= within_m
                and abs(now.height_m - height_m) <= HEIGHT_NEAR_M
            )

        body: dict[str, Any] = {"command": "goto", "lat": lat_deg, "lon": lon_deg, "height_m": height_m}
        more = {"speed_m_s": speed_m_s, "heading_deg": heading_deg}
        body |= {name: value for name, value in more.items() if value is not None}
        if there(self.telemetry):  # then only the answer says whether it was accepted
            await self._work(self._connection.operate("POST", self._path + "/commands", body))
        else:
            await self._work(self._go(body, there, timeout_s))

    async def hold(self) -> None:
        """Stays in place without sticks."""
        await self.command("hold")

    async def pause(self) -> None:
        await self.command("pause")

    async def resume(self) -> None:
        await self.command("resume")

    async def speed(self, m_s: float) -> None:
        await self.command("speed", m_s=m_s)

    async def turn(self, deg: float, *, relative: bool = False) -> None:
        """Turns to a heading, clockwise from north; `relative`: by an angle."""
        await self.command("turn", deg=deg, relative=relative)

    async def servo(self, number: int, pulse_us: int) -> None:
        """Moves a servo output of the autopilot or of its companion computer. `pulse_us`: 500 to 2500."""
        await self.command("servo", servo=number, pulse_us=pulse_us)

    async def grab(self, gripper: int = 1) -> None:
        """Closes the gripper."""
        await self.command("gripper", action="grab", gripper=gripper)

    async def release(self, gripper: int = 1) -> None:
        """Opens the gripper: what it holds falls."""
        await self.command("gripper", action="release", gripper=gripper)

    async def land(self, *, timeout_s: float = ARRIVE_WITHIN_S) -> None:
        """Lands here, and returns when the drone has disarmed."""
        await self.command("land")
        await self._seen(lambda now: now.armed is False, "landed", timeout_s)

    async def land_at(
        self,
        lat_deg: float,
        lon_deg: float,
        height_m: float,
        *,
        speed_m_s: float | None = None,
        timeout_s: float = ARRIVE_WITHIN_S,
    ) -> None:
        """Flies there at this height above home, lands there, and returns when the drone has disarmed. Raises
        OperationFailed if it does not land there, with the reason: it then flies as it was told since, or stays at the
        place."""
        place = {"lat": lat_deg, "lon": lon_deg, "height_m": height_m, "speed_m_s": speed_m_s}
        await self.command("land_at", **place)
        await self._seen(lambda now: now.armed is False, "landed", timeout_s)

    async def return_home(self, *, timeout_s: float = ARRIVE_WITHIN_S) -> None:
        """Returns home, lands, and returns when the drone has disarmed."""
        await self.command("rtl")
        await self._seen(lambda now: now.armed is False, "home and landed", timeout_s)

    @contextlib.asynccontextmanager
    async def sticks(self) -> AsyncIterator[Sticks]:
        """Flies by hand, 25 times a second, in the mode that the drone is in; centred at first. At the end the drone is
        told to hold, before the sticks stop."""
        sticks = Sticks(self._connection, self._drone_id)
        moving = asyncio.create_task(sticks.stream())
        try:
            yield sticks
        finally:
            if self.loss is None:
                with contextlib.suppress(TowerError):
                    await self.hold()
            moving.cancel()
            await asyncio.wait({moving})

    # Missions

    async def upload_mission(self, items: Sequence[Any], *, while_flying: bool = False) -> Operation:
        """Replaces the mission on board by these rows (`control_tower.mission`); read back and verified, or the old one
        stays."""
        body = {"items": list(items), "while_flying": while_flying}
        return await self._work(self._connection.operate("PUT", self._path + "/mission", body))

    async def start_mission(self, item: int = 0, *, as_it_is: bool = False) -> None:
        """Flies the mission from this item on; arms if necessary. Returns when it has begun. What earlier items set
        (speeds, the camera) is set again; raises Refused if something cannot be. `as_it_is`: nothing is set again."""
        await self.command("start", item=item, as_it_is=as_it_is or None)

    async def until_disarmed(self, *, timeout_s: float = 3600.0) -> None:
        """Waits for the end of a mission that lands."""
        await self._seen(lambda now: now.armed is False, "disarmed", timeout_s)

    async def until(
        self, condition: Callable[[Telemetry], bool], what: str, *, timeout_s: float = ARRIVE_WITHIN_S
    ) -> Telemetry:
        """Waits for telemetry that meets a condition. `what` names it in the FlightTimeout."""
        return await self._seen(condition, what, timeout_s)

    # Waiting

    async def _go(self, body: dict[str, Any], there: Callable[[Telemetry], bool], timeout_s: float) -> None:
        """Returns on arrival, even while the operation still waits to see the speed that was asked for: a short way is
        flown before that."""
        operation = await self._connection.begin("POST", self._path + "/commands", body)
        accepted = asyncio.ensure_future(self._connection.follow(operation))
        arrived = asyncio.ensure_future(self._until(there, "at the place", timeout_s))
        try:
            await asyncio.wait({accepted, arrived}, return_when=asyncio.FIRST_COMPLETED)
            if accepted.done() and not arrived.done():
                accepted.result()  # raises why it does not fly there
            await arrived
        finally:
            accepted.cancel()
            arrived.cancel()
            await asyncio.wait({accepted, arrived})
            for ended in (accepted, arrived):
                if not ended.cancelled():
                    ended.exception()  # one error is enough

    async def _seen(self, condition: Callable[[Telemetry], bool], what: str, timeout_s: float) -> Telemetry:
        return await self._work(self._until(condition, what, timeout_s))

    async def _until(self, condition: Callable[[Telemetry], bool], what: str, timeout_s: float) -> Telemetry:
        with self._connection.watch(self._drone_id) as telemetry:
            now = self.telemetry
            try:
                async with asyncio.timeout(timeout_s):
                    while not condition(now):
                        now = await anext(telemetry)
            except TimeoutError:
                raise FlightTimeout(f"{self.state.name} is not {what} after {timeout_s:g} s") from None
        return now

    async def _ready(self, timeout_s: float) -> None:
        """Waits until the tower may command it: online, heard, with a position."""
        await self._seen(lambda now: now.armed is not None and now.place is not None, "ready", timeout_s)

    async def loss_check(self) -> list[str]:
        """Returns what a loss of tower or pilot would do that is dangerous, in sentences. Empty: nothing."""
        check = await self._work(self._connection.request("GET", self._path + "/loss-check"))
        return [one["text"] for one in check["sentences"] if one["severity"] == "danger"]

    async def acknowledge_loss_check(self) -> None:
        """Says that the program's author knows `loss_check` and flies it as it is. Refused if there is nothing known
        yet."""
        with contextlib.suppress(Refused):
            body = {"drone": self.state.name}
            await self._work(self._connection.request("POST", self._path + "/loss-check/acknowledge", body))
