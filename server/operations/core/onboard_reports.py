"""Agents' reports of what is on board, beside the operations: plans, parameters, the parameter table."""

from collections.abc import Callable

from server.kernel.clock import Clock
from server.live import live_messages as live
from server.live.live_drone import LiveDrone
from server.operations.core.findings import FindingReported
from server.operations.core.table_fetching import TableFetching
from wire.controller_settings import ControllerDescribed
from wire.findings import TargetFound
from wire.transactions import ParameterCache, ParameterChanged, ParameterTable, PlanOnBoard

OnboardReport = TargetFound | ControllerDescribed | PlanOnBoard | ParameterCache | ParameterChanged | ParameterTable


class OnboardReports:
    """Has no state; that is in `drone.onboard`.

    `reads_parameters`: whether an operation at this drone requested them. `tables`: fetches missing parameter tables.
    """

    def __init__(self, clock: Clock, tables: TableFetching, *, reads_parameters: Callable[[LiveDrone], bool]) -> None:
        self._clock = clock
        self._tables = tables
        self._reads_parameters = reads_parameters

    def receive(self, drone: LiveDrone, message: OnboardReport, now: float) -> None:
        """Raises MalformedMessage."""
        match message:
            case PlanOnBoard():
                if drone.onboard.update_plan(message, self._clock()):
                    view, _ = drone.onboard.plan(message.kind)
                    drone.notify_frame_watchers(live.PlanOnBoardChanged.of(drone.drone_id, view))
            case TargetFound(sighting=True):
                sighted = drone.onboard.findings.sighted(message, drone.drone_id, now)
                if sighted is not None:
                    drone.notify_frame_watchers(sighted)
            case TargetFound():
                added = drone.onboard.findings.add(message, self._clock(), now)
                if added is not None:
                    drone.notify_frame_watchers(FindingReported(drone.drone_id, added))
            case ControllerDescribed():
                drone.onboard.controllers.described(message)
            case ParameterCache():
                self._parameters(drone, drone.onboard.parameters.update_cache(message), now)
            case ParameterChanged():
                self._parameters(drone, drone.onboard.parameters.changed(message, self._clock()), now)
            case ParameterTable():
                if self._reads_parameters(drone):  # else nobody has asked, and to check it is work
                    changed = drone.onboard.parameters.update_table(message, self._clock())
                    self._tables.came(drone, now)
                    self._parameters(drone, changed, now)

    def _parameters(self, drone: LiveDrone, changed: bool, now: float) -> None:
        if changed:
            reported = drone.onboard.parameters.state
            drone.notify_frame_watchers(
                live.ParametersChanged(drone.drone_id, reported.hash, reported.count, reported.total)
            )
        self._tables.want(drone, now)
