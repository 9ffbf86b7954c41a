"""Which parameter tables the tower lacks, and when to request them from the agent. No I/O; takes `now`."""

from collections.abc import Callable, Iterator
from typing import Final

from server.live.live_drone import LiveDrone
from server.live.live_state import LiveState
from server.operations.core.operation import Lane, Order, Step
from wire.ids import DroneId
from wire.transactions import ParametersReadWork

WITHIN_S: Final = 60.0
TABLE_AGAIN_AFTER_S: Final = 5.0
NOT_YET_S: Final = 0.25
"""An agent tells of its table right after the welcome, a moment before its first datagram makes it online."""
TABLES_APART_S: Final = 0.5
"""For one drone. Checking a table is work, and an agent may report a new hash with every message."""

FETCH: Final = Order(
    work="parameters_read",
    lane=Lane.PARAMETERS,
    steps=(Step(ParametersReadWork(again=False), WITHIN_S),),
    writes=False,
)


class TableFetching:
    """`fetch`: starts FETCH at a drone and returns whether it could. Repeated until the table arrives."""

    def __init__(self, state: LiveState, fetch: Callable[[LiveDrone, float], bool]) -> None:
        self._state = state
        self._fetch = fetch
        self._due: dict[DroneId, float] = {}

    def want(self, drone: LiveDrone, now: float) -> None:
        """The agent reported its parameters: requests the table, now or soon, if it is missing."""
        if drone.onboard.parameters.lacks_table and drone.drone_id not in self._due:
            self._ask(drone, now)

    def came(self, drone: LiveDrone, now: float) -> None:
        """A table arrived. If it was the wrong one, the next request follows soon."""
        if drone.drone_id in self._due:
            self._due[drone.drone_id] = now + TABLES_APART_S

    def tick(self, now: float) -> None:
        """Several times a second."""
        for drone_id in list(self._over(now)):
            drone = self._state.drones.get(drone_id)
            if drone is None or not drone.onboard.parameters.lacks_table:
                del self._due[drone_id]
            else:
                self._ask(drone, now)

    def _over(self, now: float) -> Iterator[DroneId]:
        return (drone_id for drone_id, due_at in self._due.items() if now >= due_at)

    def _ask(self, drone: LiveDrone, now: float) -> None:
        begun = self._fetch(drone, now)
        self._due[drone.drone_id] = now + (TABLE_AGAIN_AFTER_S if begun else NOT_YET_S)
