"""One piece of work at a drone, from the request to its end. Data only: the service decides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Final, Literal, Protocol

from server.kernel.people import UserRef
from wire.control_messages import ToAgent
from wire.ids import DroneId, Epoch
from wire.plans import PlanKind
from wire.transactions import TRANSACTIONS, LogEntry, Outcome, ParameterRefusal, Work

WorkName = Literal[
    "plan_upload",
    "plan_download",
    "plan_clear",
    "plan_verify",
    "parameters_read",
    "parameters_write",
    "command",
    "log_list",
    "log_download",
    "follow",
    "follow_me",
    "land_at",
    "agent_update",
    "signing",
    "controller",
]


class State(StrEnum):
    RUNNING = "running"
    DONE = "done"
    REFUSED = "refused"
    FAILED = "failed"
    CANCELLED = "cancelled"
    TIMED_OUT = "timed_out"


STATE_OF: Final = {
    Outcome.DONE: State.DONE,
    Outcome.REFUSED: State.REFUSED,
    Outcome.FAILED: State.FAILED,
    Outcome.CANCELLED: State.CANCELLED,
    Outcome.TIMED_OUT: State.TIMED_OUT,
    Outcome.STALE_EPOCH: State.REFUSED,
}


class Lane(StrEnum):
    """Kinds of work that a drone does side by side."""

    PLANS = "plans"
    PARAMETERS = "parameters"
    COMMANDS = "commands"
    LOGS = "logs"
    FOLLOWING = "following"
    AGENT = "agent"
    CONTROLLER = "controller"


MAX_RUNNING: Final = {
    Lane.PLANS: 1,
    Lane.PARAMETERS: 1,
    Lane.COMMANDS: 4,
    Lane.LOGS: 1,
    Lane.FOLLOWING: 1,
    Lane.AGENT: 1,
    Lane.CONTROLLER: 1,
}
"""How many operations of a lane a drone runs at a time. Few commands, because an autopilot's acknowledgement names only
the kind of command."""


@dataclass(frozen=True)
class Wait:
    """Why a step is not sent yet: `phase`, for people, and `done` of `total`. `failed`: why it will not be sent, in a
    sentence; then the operation has failed."""

    phase: str = ""
    done: int = 0
    total: int = 0
    failed: str = ""


@dataclass(frozen=True)
class Step:
    """One transaction. `phase`: for people, while it runs; empty: the agent's own text. `skip`: whether it is
    unnecessary when its turn comes. `item`: the plan item whose effect it sets again before the mission flies. `waits`:
    gets the time several times a second before the step is sent, until it returns None."""

    work: Work
    deadline_s: float
    phase: str = ""
    skip: Callable[[], bool] | None = None
    item: int | None = None
    waits: Callable[[float], Wait | None] | None = None


ResultText = Callable[[Step, Outcome, str, bool | None], str]
"""Returns the text for an operation that ended with this step, this outcome and this text of the agent. The last
argument: whether telemetry confirmed it; None: there is nothing to confirm."""


def agents_text(step: Step, outcome: Outcome, words: str, seen: bool | None) -> str:
    """Returns the agent's own text."""
    return words


@dataclass(frozen=True)
class Order:
    """What was requested. `work`: its name for programs. `steps`: they run in order, up to the first that fails.
    `writes`: it changes the drone. `hash`: of the plan concerned. `about`: details for the audit trail."""

    work: WorkName
    lane: Lane
    steps: Sequence[Step]
    writes: bool
    kind: PlanKind | None = None
    hash: str | None = None
    audited: bool = False
    """The audit trail records it although it changes nothing; writes are always recorded."""
    overrules: bool = False
    """It decides how the drone flies: it replaces earlier commands and is exempt from the limit."""
    stops: bool = False
    """It stops the drone, returns or lands it: exempt from the rate limit."""
    restarts_agent: bool = False
    """The agent starts again in the middle of it, and the new process reports the end."""
    needs: str = TRANSACTIONS
    """The capability that the agent must have reported."""
    result_text: ResultText = agents_text
    about: dict[str, object] = field(default_factory=dict)


class TransactionLink(Protocol):
    """What an operation knows of the link that carries its transaction (`server.link.core.agent_link.AgentLink`)."""

    process: int
    """Number of the agent process at its other end; 0: not reported."""
    has_channel: bool

    def post(self, message: ToAgent) -> None:
        """Sends it by the control channel."""


@dataclass
class Operation:
    """Owned by the service while it runs. After its end only the report of an agent that returns late changes it."""

    id: int
    drone_id: DroneId
    drone_name: str
    order: Order
    by: UserRef | None
    """None: the tower itself."""
    epoch: Epoch
    began_at: datetime
    address: str = ""
    request_id: str = ""
    """Of the request that began it; goes to the agent, for its log."""
    state: State = State.RUNNING
    phase: str = ""
    done: int = 0
    total: int = 0
    words: str = ""
    item: int | None = None
    code: str = ""
    seen: bool | None = None
    refusals: tuple[ParameterRefusal, ...] = ()
    refused: int = 0
    logs: tuple[LogEntry, ...] | None = None
    plan: bytes | None = None
    """Content of a download, packed."""
    ended_at: datetime | None = None

    # -- the service's own --------------------------------------------------------------------------------------
    commanded: int = 0
    """`LiveDrone.commanded` when it began. If that has grown, somebody else has commanded the drone since."""
    next_step: int = 0
    transaction_id: int = 0
    link: TransactionLink | None = None
    deadline: float = 0.0
    """When the agent must have ended the transaction, on the clock of `now`."""
    latest: float = 0.0
    """Until when progress may extend the deadline, on the same clock."""
    ended_s: float = 0.0
    """When it ended, on the same clock."""
    link_lost: bool = False
    ask_at: float | None = None
    """When to ask the agent about it, if it has reported nothing since its link returned."""
    cancelling: bool = False
    on_end: list[Callable[[Operation], None]] = field(default_factory=list)

    @property
    def step(self) -> Step:
        """The step whose transaction runs, or ran last. Raises IndexError once they are dropped
        (`KeptOperations.ended`)."""
        return self.order.steps[self.next_step - 1]

    @property
    def running(self) -> bool:
        return self.state is State.RUNNING


def is_another_agent(before: TransactionLink | None, now: TransactionLink) -> bool:
    """Whether the agent process is known to be another one. An old agent does not report its process."""
    return before is not None and before.process != 0 and now.process != 0 and before.process != now.process
