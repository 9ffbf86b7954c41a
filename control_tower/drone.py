"""A drone of the squad: its state, its telemetry, what is on board, and the way to fly it."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Iterator
from typing import TYPE_CHECKING, Any, Literal

from control_tower.connection import Connection
from control_tower.errors import ControlLost, Refused, TowerError
from control_tower.events import Event
from control_tower.flight import Flight
from control_tower.streams import Stream, uninterrupted
from control_tower.values import DroneState, Telemetry

if TYPE_CHECKING:
    from control_tower.pictures import Picture

ALREADY_YOURS = "already-yours"
OFFLINE_S = 10.0
AtError = Literal["rtl", "land", "hold"]
Measure = Literal["muted", "limited", "quarantined"]
"""Against a drone that sends too much; each includes the milder ones."""


class Drone:
    """Get one from `Tower.drone`."""

    def __init__(self, connection: Connection, drone_id: int) -> None:
        self._connection = connection
        self.id = drone_id
        self._path = f"/drones/{drone_id}"

    def __repr__(self) -> str:
        return f"<Drone {self.id} {self.name}>"

    @property
    def state(self) -> DroneState:
        """The drone as the tower reported it last. Raises TowerError if the user may not see it any more."""
        try:
            return self._connection.states[self.id]
        except KeyError:
            raise TowerError(f"drone {self.id} is not in your squad any more") from None

    @property
    def name(self) -> str:
        return self.state.name

    @property
    def telemetry(self) -> Telemetry:
        """The newest telemetry; its members are None before the first message."""
        return self._connection.telemetry(self.id)

    def watch(self) -> contextlib.AbstractContextManager[Stream[Telemetry]]:
        """`with drone.watch() as telemetry: async for now in telemetry:` Each new state; the newest only for a slow
        reader."""
        return self._connection.watch(self.id)

    @contextlib.contextmanager
    def events(self) -> Iterator[Stream[Event]]:
        """As `watch`, of all events about this drone from now on. The stream raises TooSlow if nobody reads it."""
        with self._connection.events(self.id) as stream:
            yield stream

    async def mission(self, *, fresh: bool = False) -> list[Any]:
        """Returns the rows of the mission on board; `fresh` reads it from the autopilot now. Raises TowerError if it is
        not known."""
        plan = await self._connection.request("GET", f"{self._path}/mission{'?fresh=true' if fresh else ''}")
        if plan["items"] is None:
            raise TowerError(f"the mission on board of {self.name} is not known yet: read it with fresh=True")
        return list(plan["items"])

    async def request(self, method: str, path: str, body: Any = None) -> Any:
        """Sends any request of the REST API about this drone; `path` follows `/drones/{id}`."""
        return await self._connection.request(method, self._path + path, body)

    async def effects(self) -> dict[Measure, str]:
        """What muting, limiting or quarantining this drone would do to its flight now, in words. For an admin of the
        tower or of its team, else Refused."""
        answer = await self._connection.request("GET", f"{self._path}/restraint")
        return {one["measure"]: one["effect"] for one in answer["measures"]}

    async def restrain(self, measure: Measure, reason: str = "", *, confirmed: bool = False) -> None:
        """Mutes, limits or quarantines it because it sends too much, until `unrestrain`. `effects` says what that does.
        A quarantine cuts its link: in the air it raises Refused (`loses-its-link`) unless `confirmed`."""
        body = {"measure": measure, "reason": reason, "confirmed": confirmed}
        await self._connection.request("PUT", f"{self._path}/restraint", body)

    async def unrestrain(self) -> None:
        """Lifts what an admin did. Harmless if nobody did."""
        await self._connection.request("DELETE", f"{self._path}/restraint")

    @contextlib.asynccontextmanager
    async def video(
        self,
        *,
        quality: Literal["low", "medium", "high"] = "medium",
        codecs: str = "h264,mpeg1",
        pixel_format: Literal["rgb24", "bgr24", "gray"] = "rgb24",
    ) -> AsyncIterator[AsyncIterator[Picture]]:
        """`async with drone.video() as pictures: async for picture in pictures:` Each picture as a NumPy array
        (`control_tower.pictures.Picture`), the newest for a program that takes long. `codecs`: the first that the drone
        has. Needs the extra `video`, else TowerError."""
        try:
            from control_tower.pictures import pictures
        except ImportError:
            raise TowerError("video needs av and numpy: pip install 'control-tower-sdk[video]'") from None
        query = f"quality={quality}&codec={codecs}"
        address, headers, proxy = self._connection.video_connection(self.id, query)
        coming = pictures(address, headers, proxy=proxy, pixel_format=pixel_format)
        async with contextlib.aclosing(coming):
            yield coming

    @contextlib.asynccontextmanager
    async def begin_flight(self, *, take: bool = False, offline_s: float = OFFLINE_S) -> AsyncIterator[Flight]:
        """The parts of `fly` without its cancellation: the controls, the presence, and the watch over both."""
        connection = self._connection
        async with connection.presence():
            with connection.events(self.id) as events:
                acquired = True
                try:
                    answer = await connection.request(
                        "POST", f"{self._path}/control/{'take' if take else 'acquire'}", {}
                    )
                except Refused as refused:
                    if refused.code != ALREADY_YOURS:
                        raise
                    acquired, answer = False, await connection.request("GET", self._path)
                state = DroneState.of(answer)
                flight = Flight(
                    connection,
                    self.id,
                    state.epoch,
                    acquired=acquired,
                    expects_hold=take or state.hold_open,
                    offline_s=offline_s,
                )
                watching = asyncio.create_task(flight.watch(events))
                try:
                    yield flight
                finally:
                    watching.cancel()
                    await uninterrupted(asyncio.wait({watching}))

    @contextlib.asynccontextmanager
    async def fly(
        self, *, take: bool = False, at_error: AtError | None = "rtl", offline_s: float = OFFLINE_S
    ) -> AsyncIterator[Flight]:
        """Acquires the controls, keeps them alive, and releases them at the end.

        When the program does not fly the drone any more (TAKE, a hold, a lost link), the body is cancelled where it
        waits, and this raises ControlLost. After any other error, or Ctrl-C, in the air the drone gets the command
        `at_error` before the controls are released. `take`: as an admin, from whoever has them. `offline_s`: how long
        the drone may be offline. Raises Refused if the controls are not available.
        """
        task = asyncio.current_task()
        assert task is not None
        cancelling = task.cancelling()
        async with self.begin_flight(take=take, offline_s=offline_s) as flight:
            flight.own(task)
            failed = True
            try:
                yield flight
                failed = False
            except BaseException as error:
                if flight.cancelled_owner and task.uncancel() <= cancelling and flight.loss is not None:
                    raise ControlLost(flight.loss) from error
                raise
            finally:
                flight.own(None)
                await uninterrupted(flight.finish(failed, at_error))
            if flight.loss is not None:
                if flight.cancelled_owner:
                    task.uncancel()
                raise ControlLost(flight.loss)
