"""An agent with a simulated vehicle, and its reports on transactions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from model_agent import ModelAgent

from onboard_agent.onboard import Onboard
from onboard_agent.transactions.plan_replacement import Phase, PlanReplacement
from wire.control_messages import ToTower
from wire.ids import DroneId
from wire.plans import Plan, PlanKind
from wire.transactions import TRANSACTIONS, Outcome

DRONE = DroneId(1)
MISSION = PlanKind.MISSION


class MemoryJournal:
    """The agent's disk. It survives the agent's process."""

    def __init__(self) -> None:
        self.records: dict[PlanKind, bytes] = {}

    def load(self, kind: PlanKind) -> bytes | None:
        return self.records.get(kind)

    def save(self, kind: PlanKind, record: bytes) -> None:
        self.records[kind] = record

    def remove(self, kind: PlanKind) -> None:
        self.records.pop(kind, None)


@dataclass
class ParamValue:
    """The agent's result of a transaction, and the plan on board at that moment."""

    outcome: Outcome
    words: str
    on_board: Plan
    epoch: int


class VehicleLine(Protocol):
    """The parts of the world that an agent needs."""

    now: float
    journal: MemoryJournal

    def on_board(self) -> Plan: ...
    def from_vehicle(self) -> list[bytes]: ...
    def to_vehicle(self, frame: bytes) -> None: ...
    def ended(self, transaction_id: int, reported: ParamValue) -> None: ...


class PlanAgent(ModelAgent):
    """An agent with a vehicle instead of a fake autopilot."""

    takes = (TRANSACTIONS,)

    def __init__(self, world: VehicleLine, process: int) -> None:
        self._world = world
        onboard = Onboard(now=world.now, speaks_first=False, journal=world.journal)
        super().__init__(DRONE, world.now, onboard=onboard, process=process)
        service = self.service
        announce = service._report

        def noting(transaction_id: int, outcome: Outcome, words: str, **more: Any) -> None:
            world.ended(transaction_id, ParamValue(outcome, words, world.on_board(), onboard.downlink.epoch))
            announce(transaction_id, outcome, words, **more)

        service._report = noting  # type: ignore[method-assign]

    @property
    def service(self) -> Any:
        """The service for plans."""
        return self.onboard._work._plans._handler

    @property
    def why_no_start(self) -> str | None:
        return self.onboard._work._plans.why_no_start

    def _autopilot_beats(self, now: float) -> None:
        frames = self._world.from_vehicle()
        if frames:
            self.onboard.from_autopilot(frames, now)

    def _to_autopilot(self) -> None:
        for frame in self.onboard.frames_to_autopilot():
            self._world.to_vehicle(frame)

    def _announce(self, hub: Any, message: ToTower, now: float) -> None:
        super()._announce(hub, message, now)

    @property
    def has_written(self) -> bool:
        """Whether it is past the point at which it would still notice that a mission is being flown."""
        running = self.service._running
        return running is not None and isinstance(running.machine, PlanReplacement) and running.machine.has_written

    def writes_under_an_older_epoch(self) -> bool:
        running = self.service._running
        if running is None or running.transaction is None or not isinstance(running.machine, PlanReplacement):
            return False
        older = running.transaction.epoch < self.onboard.downlink.epoch
        return older and running.machine.phase is Phase.WRITING
