"""One piece of work at a drone, from the request to its end. Data, and nothing that decides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Final, Literal, Protocol

from server.domain.people import UserRef
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
    """What one drone does side by side."""

    PLANS = "plans"
    PARAMETERS = "parameters"
    COMMANDS = "commands"
    LOGS = "logs"
    FOLLOWING = "following"


AT_ONCE: Final = {Lane.PLANS: 1, Lane.PARAMETERS: 1, Lane.COMMANDS: 4, Lane.LOGS: 1, Lane.FOLLOWING: 1}
"""How many operations of a lane a drone has at a time. An autopilot answers commands by their number only, so few."""


@dataclass(frozen=True)
class Step:
    """One transaction. `phase`: for people, while it runs; empty: what the agent says of it. `skip`: whether it has
    become needless when its turn comes."""

    work: Work
    deadline_s: float
    phase: str = ""
    skip: Callable[[], bool] | None = None


Say = Callable[[Step, Outcome, str, bool | None], str]
"""The words of an operation that ended with this step, like that, of which the agent said so, and whether it saw it."""


def as_said(step: Step, outcome: Outcome, words: str, seen: bool | None) -> str:
    """What the agent says, and nothing else."""
    return words


@dataclass(frozen=True)
class Order:
    """What is asked for. `work`: its name for programs; `steps` are done one after the other, up to the first that
    does not end well. `writes`: it changes the drone. `hash`: of the plan that it is about. `about`: for the trail."""

    work: WorkName
    lane: Lane
    steps: Sequence[Step]
    writes: bool
    kind: PlanKind | None = None
    hash: str | None = None
    noted: bool = False
    """It stands in the audit trail though it changes nothing; what writes always does."""
    overrules: bool = False
    """It says how the drone is to fly: no step of an earlier order comes after it, and it is never one too many."""
    stops: bool = False
    """It brings the drone to a stop, home or down: asking for too much else does not keep anybody from it."""
    needs: str = TRANSACTIONS
    """What the agent must have said that it takes."""
    say: Say = as_said
    about: dict[str, object] = field(default_factory=dict)


class Carrier(Protocol):
    """What an operation knows of the link that carries its transaction (`server.live.relay.agent_link.AgentLink`)."""

    process: int
    """Which process of the agent has it; 0: it does not say."""
    has_channel: bool

    def post(self, message: ToAgent) -> None:
        """Send it by the control channel."""


@dataclass
class Operation:
    """Owned by the service while it runs; never changed after its end, but by an agent that came back late."""

    id: int
    drone_id: DroneId
    drone_name: str
    order: Order
    by: UserRef | None
    """None: the tower itself."""
    epoch: Epoch
    began_at: datetime
    address: str = ""
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
    """Of a download, packed."""
    ended_at: datetime | None = None

    # -- the service's own --------------------------------------------------------------------------------------
    commanded: int = 0
    """LiveDrone.commanded when it began."""
    next_step: int = 0
    transaction_id: int = 0
    link: Carrier | None = None
    deadline: float = 0.0
    """When the agent must have ended the transaction, on the clock of `now`."""
    over_since: float = 0.0
    link_lost: bool = False
    ask_at: float | None = None
    """When the agent is asked what became of it, where it has said nothing since its link is back."""
    cancelling: bool = False
    on_end: list[Callable[[Operation], None]] = field(default_factory=list)

    @property
    def step(self) -> Step:
        """The one that runs, or, of one that was given up, was the last. After any other end there is none."""
        return self.order.steps[self.next_step - 1]

    @property
    def running(self) -> bool:
        return self.state is State.RUNNING


def is_another_agent(before: Carrier | None, now: Carrier) -> bool:
    """Whether that is known: an old agent does not say which process it is."""
    return before is not None and before.process != 0 and now.process != 0 and before.process != now.process
