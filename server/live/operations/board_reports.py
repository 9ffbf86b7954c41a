"""What agents say of what is on board, beside the operations: plans, parameters, the table of parameters."""

from collections.abc import Callable

from server.domain.clock import Clock
from server.live.operations.table_fetching import TableFetching
from server.live.relay import live_messages as live
from server.live.relay.live_drone import LiveDrone
from wire.transactions import ParameterCache, ParameterChanged, ParameterTable, PlanOnBoard

BoardReport = PlanOnBoard | ParameterCache | ParameterChanged | ParameterTable


class BoardReports:
    """No state of its own: it is in `drone.board`. `reads_parameters`: whether an operation at this drone asked for
    them. `tables`: fetches a table of parameters that is lacking."""

    def __init__(self, clock: Clock, tables: TableFetching, *, reads_parameters: Callable[[LiveDrone], bool]) -> None:
        self._clock = clock
        self._tables = tables
        self._reads_parameters = reads_parameters

    def receive(self, drone: LiveDrone, message: BoardReport, now: float) -> None:
        """Raises MalformedMessage about what is not what it says."""
        match message:
            case PlanOnBoard():
                if drone.board.plan_told(message, self._clock()):
                    view, _ = drone.board.plan(message.kind)
                    drone.notify_frame_watchers(live.PlanOnBoardChanged.of(drone.drone_id, view))
            case ParameterCache():
                self._parameters(drone, drone.board.parameters.cache_told(message), now)
            case ParameterChanged():
                self._parameters(drone, drone.board.parameters.changed(message, self._clock()), now)
            case ParameterTable():
                if self._reads_parameters(drone):  # else nobody has asked, and to check it is work
                    drone.board.parameters.table_told(message, self._clock())
                    self._tables.came(drone, now)

    def _parameters(self, drone: LiveDrone, changed: bool, now: float) -> None:
        if changed:
            told = drone.board.parameters.told
            drone.notify_frame_watchers(live.ParametersChanged(drone.drone_id, told.hash, told.count, told.total))
        self._tables.want(drone, now)
