"""The typed messages with which the tower has work done at the drone: plans, parameters, commands (no I/O).

They travel on the control channel beside those of wire.control_messages. A tower sends none to an agent that has not
said that it takes them: an unknown type ends the channel. `id` is the tower's, and grows; what an agent tells of an id
that the tower has forgotten says nothing.
"""

from enum import StrEnum
from typing import Annotated, Final

import msgspec

from wire.plans import I32, U8, U16, BoundedPlan, PlanKind

LARGEST_TRANSACTION_BYTES: Final = 256 * 1024
"""A plan of 724 items is 118 kB as JSON at the most; the bound of a message is raised to this after the welcome."""

VALUES_MOST: Final = 4096
"""More parameters than any autopilot has."""

U32 = Annotated[int, msgspec.Meta(ge=0, le=0xFFFFFFFF)]
Words = Annotated[str, msgspec.Meta(max_length=600)]
ParameterName = Annotated[str, msgspec.Meta(min_length=1, max_length=16)]


class Outcome(StrEnum):
    """How a piece of work ended."""

    DONE = "done"
    REFUSED = "refused"
    """Nothing was begun: not allowed, busy, or no such thing."""
    FAILED = "failed"
    CANCELLED = "cancelled"
    TIMED_OUT = "timed_out"
    STALE_EPOCH = "stale_epoch"


class PlanDownloadWork(msgspec.Struct, frozen=True, tag="plan_download", tag_field="work"):
    """Read the plan that is on board."""

    kind: PlanKind


class PlanUploadWork(msgspec.Struct, frozen=True, tag="plan_upload", tag_field="work"):
    """Put this plan on board: the whole of it, or the old one stays. Of no items: as to clear it."""

    kind: PlanKind
    items: BoundedPlan
    while_flying: bool = False


class PlanClearWork(msgspec.Struct, frozen=True, tag="plan_clear", tag_field="work"):
    """Take the plan off the drone."""

    kind: PlanKind
    while_flying: bool = False


class PlanVerifyWork(msgspec.Struct, frozen=True, tag="plan_verify", tag_field="work"):
    """Read the plan on board and say whether it is this one."""

    kind: PlanKind
    items: BoundedPlan


class ParametersReadWork(msgspec.Struct, frozen=True, tag="parameters_read", tag_field="work"):
    """Tell the parameters. `again`: ask the autopilot anew, not the cache."""

    again: bool = False


class ParametersWriteWork(msgspec.Struct, frozen=True, tag="parameters_write", tag_field="work"):
    """Write these, in this order, each read back."""

    values: Annotated[tuple[tuple[ParameterName, float], ...], msgspec.Meta(max_length=VALUES_MOST)]


class CommandWork(msgspec.Struct, frozen=True, tag="command", tag_field="work"):
    """A MAV_CMD with its answer. With `x`, `y` and `frame` it goes as COMMAND_INT, else as COMMAND_LONG.

    `params`: param1 to param7, None for NaN; of a COMMAND_INT param5 and param6 are `x` and `y`.
    """

    command: U16
    params: tuple[float | None, float | None, float | None, float | None, float | None, float | None, float | None] = (
        0.0,
    ) * 7
    x: I32 | None = None
    y: I32 | None = None
    frame: U8 | None = None


Work = (
    PlanDownloadWork
    | PlanUploadWork
    | PlanClearWork
    | PlanVerifyWork
    | ParametersReadWork
    | ParametersWriteWork
    | CommandWork
)


class Transaction(msgspec.Struct, frozen=True, tag="transaction", tag_field="type", kw_only=True):
    """Tower to agent: do this. `epoch`: what writes is refused under an older one than the agent knows."""

    id: U32
    epoch: U32
    deadline_s: Annotated[float, msgspec.Meta(gt=0, le=600)]
    work: Work


class CancelTransaction(msgspec.Struct, frozen=True, tag="cancel_transaction", tag_field="type", kw_only=True):
    """Tower to agent: stop it. A plan that is being written is put back; the result still comes."""

    id: U32


class TransactionProgress(msgspec.Struct, frozen=True, tag="transaction_progress", tag_field="type", kw_only=True):
    """Agent to tower, at most five a second. `done` of `total` items, values or tries of this `phase`."""

    id: U32
    phase: str
    done: U32
    total: U32


class TransactionResult(msgspec.Struct, frozen=True, tag="transaction_result", tag_field="type", kw_only=True):
    """Agent to tower, once, the last of a transaction.

    `words`: for people, what failed, why, and what is on board now. `item`: the item of the plan that was refused, from
    0. `code`: the name of the MAV_MISSION_RESULT or MAV_RESULT, empty where there is none. `plan`: of a download.
    `values`: of a parameter write, name by name what the autopilot has now.
    """

    id: U32
    outcome: Outcome
    words: Words
    item: U16 | None = None
    code: str = ""
    plan: BoundedPlan | None = None
    values: dict[str, float] | None = None


class PlanOnBoard(msgspec.Struct, frozen=True, tag="plan_on_board", tag_field="type", kw_only=True):
    """Agent to tower, when learnt and on each change. `hash` None: not known; else of the plan as the autopilot has it.

    `sent_hash`: of the plan that was sent, where the autopilot is known to have kept it, some fields in its own way.
    `fit_to_fly` False: it may be half of one; the agent lets no mission be started.
    """

    kind: PlanKind
    hash: str | None
    count: U16 = 0
    items: BoundedPlan | None = None
    sent_hash: str | None = None
    fit_to_fly: bool = True


TransactionToAgent = Transaction | CancelTransaction
TransactionToTower = TransactionProgress | TransactionResult | PlanOnBoard
