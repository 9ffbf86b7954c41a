"""An agent that talks with a simulated vehicle, and what it says of its transactions."""

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
    """The agent's disk, which outlasts it."""

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
    """How the agent said that a transaction ended, and what was on board at that moment."""

    outcome: Outcome
    words: str
    on_board: Plan
    epoch: int


class VehicleLine(Protocol):
    """What an agent needs of the world that it lives in."""

    now: float
    journal: MemoryJournal

    def on_board(self) -> Plan: ...
    def from_vehicle(self) -> list[bytes]: ...
    def to_vehicle(self, frame: bytes) -> None: ...
    def ended(self, transaction_id: int, reported: ParamValue) -> None: ...


class PlanAgent(ModelAgent):
    """An agent that talks with a vehicle instead of an autopilot that is made up."""

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
        """Its plans."""
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
        """It is past the point at which it would still notice that a mission is being flown."""
        running = self.service._running
        return running is not None and isinstance(running.machine, PlanReplacement) and running.machine.has_written

    def writes_under_an_older_epoch(self) -> bool:
        running = self.service._running
        if running is None or running.transaction is None or not isinstance(running.machine, PlanReplacement):
            return False
        older = running.transaction.epoch < self.onboard.downlink.epoch
        return older and running.machine.phase is Phase.WRITING
