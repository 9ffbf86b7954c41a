"""A hub with one drone, its agent and an operator who requests operations."""

from typing import Any

from hub_world import FakeAgent, HubWorld

from server.kernel.people import UserRef
from server.live import live_messages as live
from server.live.live_drone import LiveDrone
from server.operations.core.operation import Lane, Operation, Order, Step
from wire.ids import DroneId, UserId
from wire.plans import PlanItem, PlanKind
from wire.transactions import (
    TRANSACTIONS,
    CancelTransaction,
    CommandWork,
    Outcome,
    PlanDownloadWork,
    PlanUploadWork,
    Transaction,
    TransactionResult,
)

ALICE = UserRef(UserId(1), "alice")
ITEMS = (PlanItem(16, x=470000000, y=80000000, z=30.0), PlanItem(21, params=(0.0, 0.0, 0.0, None)))
UPLOAD = Order("plan_upload", Lane.PLANS, [Step(PlanUploadWork(PlanKind.MISSION, ITEMS), 60.0)], True, PlanKind.MISSION)
COMMAND = Order("command", Lane.COMMANDS, [Step(CommandWork(400), 5.0), Step(CommandWork(22), 5.0)], True)
DOWNLOAD = Order("plan_download", Lane.PLANS, [Step(PlanDownloadWork(PlanKind.MISSION), 60.0)], False, PlanKind.MISSION)


class Scene(HubWorld):
    """alice's drone with an agent that accepts transactions, and a browser that watches."""

    def __init__(self, *, takes: tuple[str, ...] = (TRANSACTIONS,), process: int = 7) -> None:
        super().__init__()
        self.service = self.hub.operations
        self.watcher = self.browser(1)
        self.agent_ = self.come(takes=takes, process=process)
        self.watcher.events()
        self.now = 0.0

    def come(self, *, takes: tuple[str, ...] = (TRANSACTIONS,), process: int = 7, link_id: int = 0) -> FakeAgent:
        agent = self.agent(1, link_id=link_id)
        agent.link.takes, agent.link.process = frozenset(takes), process
        agent.posted.clear()
        return agent

    @property
    def drone(self) -> LiveDrone:
        found = self.hub.state.drones.get(DroneId(1))
        assert found is not None
        return found

    def begin(self, order: Order = UPLOAD) -> Operation:
        return self.service.begin(self.drone, order, by=ALICE, now=self.now)

    def announce(self, message: Any, agent: FakeAgent | None = None) -> None:
        self.hub.reports.receive((agent or self.agent_).link, message)

    def end(self, operation: Operation, outcome: Outcome = Outcome.DONE, words: str = "So it is.", **more: Any) -> None:
        self.announce(TransactionResult(id=operation.transaction_id, outcome=outcome, words=words, **more))

    def pass_time(self, seconds: float) -> None:
        self.now += seconds
        self.service.tick(self.now)

    def reported(self) -> list[Any]:
        kinds = (live.OperationChanged, live.PlanOnBoardChanged, live.ParametersChanged)
        return [event for event in self.watcher.events() if isinstance(event, kinds)]

    def sent(self) -> list[Any]:
        posted = [one for one in self.agent_.posted if isinstance(one, Transaction | CancelTransaction)]
        self.agent_.posted.clear()
        return posted
