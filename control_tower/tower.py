"""A tower as one user sees it: where every program begins."""

from __future__ import annotations

import contextlib
from types import TracebackType
from typing import Any, Self

from control_tower.connection import Connection
from control_tower.drone import Drone
from control_tower.events import Event
from control_tower.streams import Stream
from control_tower.values import User


class Tower:
    """An asynchronous context manager. `address` and `token` default to the environment variables TOWER_URL and
    TOWER_TOKEN. `rate_hz`: of telemetry, 0.2 to 20. Entering it raises SignInRefused or TowerUnreachable."""

    def __init__(self, address: str = "", token: str = "", *, rate_hz: float = 10.0) -> None:
        self._connection = Connection(address, token, rate_hz=rate_hz)

    async def __aenter__(self) -> Self:
        await self._connection.open()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self._connection.close()

    @property
    def user(self) -> User:
        """Who is signed in."""
        return self._connection.user

    @property
    def drones(self) -> list[Drone]:
        """The squad: all drones that the user may see, by id."""
        return [Drone(self._connection, drone_id) for drone_id in sorted(self._connection.states)]

    def drone(self, which: str | int) -> Drone:
        """Returns a drone by its name (case ignored) or id. Raises KeyError with the names there are."""
        for drone in self.drones:
            if which == drone.id or str(which).casefold() in (drone.name.casefold(), str(drone.id)):
                return drone
        names = ", ".join(drone.name for drone in self.drones) or "none"
        raise KeyError(f"there is no drone {which} in your squad; there is {names}")

    def events(self) -> contextlib.AbstractContextManager[Stream[Event]]:
        """`with tower.events() as events: async for event in events:` All events from now on. The stream raises TooSlow
        if nobody reads it."""
        return self._connection.events()

    async def request(self, method: str, path: str, body: Any = None) -> Any:
        """Sends any request of the REST API (docs/api.md); `path` is relative to `/api/v1`. Returns the parsed JSON."""
        return await self._connection.request(method, path, body)
