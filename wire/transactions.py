"""The typed messages by which the tower requests work of the agent: plans, parameters, commands (no I/O).

They travel on the control channel beside those of wire.control_messages. Neither side sends any unless the other has
listed TRANSACTIONS in its hello or welcome: an unknown type is dropped. `id` is assigned by the tower, and
grows; the tower ignores reports on an id that it has forgotten. Messages to the tower fit its limit of 64 kB: plans and
parameter tables are packed, refusals beyond the first are only counted.
"""

from enum import StrEnum
from typing import Annotated, Final

import msgspec

from wire.agent_update import AgentUpdateWork
from wire.controller_settings import ControllerDescribed
from wire.controllers import ControllerWork
from wire.findings import TargetFound
from wire.following import FollowWork, LeaderPosition
from wire.parameter_metadata import MetadataToTower, MetadataWanted
from wire.plans import I32, MAX_ITEMS_ANY, U8, U16, BoundedPlan, PlanKind
from wire.signing_key import SigningWork

MAX_TRANSACTION_BYTES: Final = 256 * 1024
"""A plan of 724 items is at most 118 kB as JSON; the message limit is raised to this after the welcome."""

MAX_PACKED_PLAN_BYTES: Final = 3 + 32 * MAX_ITEMS_ANY
MAX_PACKED_TABLE_BYTES: Final = 45_000
"""60 kB in base64."""

TRANSACTIONS: Final = "transactions"
"""The entry in `takes` of hello and welcome for the messages of this module."""

MAX_VALUES: Final = 4096
"""More parameters than any autopilot has."""

PROGRESS_EXTENDS_S: Final = 10.0
"""Each MAV_RESULT_IN_PROGRESS gives a command at least this much longer."""
MAX_EXTENDED_S: Final = 300.0
"""How much longer than its deadline a command may take by that."""

MAX_REFUSALS: Final = 200
MAX_LOGS: Final = 500
"""The newest logs; an autopilot numbers them up to 65535, and keeps a few hundred."""

U32 = Annotated[int, msgspec.Meta(ge=0, le=0xFFFFFFFF)]
Words = Annotated[str, msgspec.Meta(max_length=600)]
ParameterName = Annotated[str, msgspec.Meta(min_length=1, max_length=16)]
PackedPlan = Annotated[bytes, msgspec.Meta(max_length=MAX_PACKED_PLAN_BYTES)]
Hash = Annotated[str, msgspec.Meta(min_length=16, max_length=16)]


class Outcome(StrEnum):
    """How a piece of work ended."""

    DONE = "done"
    REFUSED = "refused"
    """Nothing was started: not allowed, busy, or unknown."""
    FAILED = "failed"
    CANCELLED = "cancelled"
    TIMED_OUT = "timed_out"
    STALE_EPOCH = "stale_epoch"


class PlanDownloadWork(msgspec.Struct, frozen=True, tag="plan_download", tag_field="work"):
    """Read the plan that is on board."""

    kind: PlanKind


class PlanUploadWork(msgspec.Struct, frozen=True, tag="plan_upload", tag_field="work"):
    """Write this plan: all of it, or the old one stays. A plan without items clears it."""

    kind: PlanKind
    items: BoundedPlan
    while_flying: bool = False


class PlanClearWork(msgspec.Struct, frozen=True, tag="plan_clear", tag_field="work"):
    """Remove the plan from the drone."""

    kind: PlanKind
    while_flying: bool = False


class PlanVerifyWork(msgspec.Struct, frozen=True, tag="plan_verify", tag_field="work"):
    """Read the plan on board and report whether it is this one."""

    kind: PlanKind
    items: BoundedPlan


class ParametersReadWork(msgspec.Struct, frozen=True, tag="parameters_read", tag_field="work"):
    """Report the parameters. `again`: read them from the autopilot, not from the cache."""

    again: bool = False


class ParametersWriteWork(msgspec.Struct, frozen=True, tag="parameters_write", tag_field="work"):
    """Write these, in this order, each read back."""

    values: Annotated[tuple[tuple[ParameterName, float], ...], msgspec.Meta(max_length=MAX_VALUES)]


class CommandWork(msgspec.Struct, frozen=True, tag="command", tag_field="work"):
    """A MAV_CMD with its acknowledgement. With `x`, `y` and `frame` it is sent as COMMAND_INT, else as COMMAND_LONG.

    `params`: param1 to param7, None for NaN; in a COMMAND_INT param5 and param6 are `x` and `y`.
    """

    command: U16
    params: tuple[float | None, float | None, float | None, float | None, float | None, float | None, float | None] = (
        0.0,
    ) * 7
    x: I32 | None = None
    y: I32 | None = None
    frame: U8 | None = None
    component: U8 = 1
    """Whom it is for: the autopilot, or a camera of the vehicle."""


class LogListWork(msgspec.Struct, frozen=True, tag="log_list", tag_field="work"):
    """List the autopilot's flight logs."""


class LogDownloadWork(msgspec.Struct, frozen=True, tag="log_download", tag_field="work"):
    """Read this log from the autopilot and send it to the tower: `PUT /api/v1/agent/files/{id of the transaction}`."""

    log_id: U16


Work = (
    PlanDownloadWork
    | PlanUploadWork
    | PlanClearWork
    | PlanVerifyWork
    | ParametersReadWork
    | ParametersWriteWork
    | CommandWork
    | LogListWork
    | LogDownloadWork
    | FollowWork
    | AgentUpdateWork
    | ControllerWork
    | SigningWork
)


class Transaction(msgspec.Struct, frozen=True, tag="transaction", tag_field="type", kw_only=True):
    """Tower to agent: do this. `epoch`: writes under an epoch older than the agent's are refused.

    `sent_ms`: the tower's clock, as in its datagrams (wire.lateness.stamp_ms): a command that is too late by it is
    never executed. None: not known.
    """

    id: U32
    epoch: U32
    sent_ms: U32 | None = None
    deadline_s: Annotated[float, msgspec.Meta(gt=0, le=600)]
    work: Work
    trace: Annotated[str, msgspec.Meta(max_length=64, pattern=r"^[A-Za-z0-9._-]*$")] = ""
    """The id of the person's request, for the agent's log. Empty: there is none, or the tower is older."""


class CancelTransaction(msgspec.Struct, frozen=True, tag="cancel_transaction", tag_field="type", kw_only=True):
    """Tower to agent: stop it. A plan that is being written is restored; the result still follows, even for an id that
    the agent does not know."""

    id: U32


class TransactionProgress(msgspec.Struct, frozen=True, tag="transaction_progress", tag_field="type", kw_only=True):
    """Agent to tower, at most five per second. `done` of `total` items, values or tries of this `phase`."""

    id: U32
    phase: str
    done: U32
    total: U32


class ParameterRefusal(msgspec.Struct, frozen=True, array_like=True):
    """A parameter whose value is not the requested one. `has`: the autopilot's value now, None if unknown."""

    name: ParameterName
    asked: float
    has: float | None
    words: Annotated[str, msgspec.Meta(max_length=160)]


class LogEntry(msgspec.Struct, frozen=True, array_like=True):
    """One flight log of the autopilot. `began_unix_s` None: its clock was not set."""

    log_id: U16
    size_bytes: U32
    began_unix_s: U32 | None


class TransactionResult(msgspec.Struct, frozen=True, tag="transaction_result", tag_field="type", kw_only=True):
    """Agent to tower, once, the last message of a transaction.

    `words`: for people, what failed, why, and what is on board now. `item`: the plan item that was refused, from 0.
    `code`: the name of the MAV_MISSION_RESULT or MAV_RESULT, empty if there is none. `plan`: of a download, packed by
    `wire.plans.pack_plan`. `refusals`: of a parameter write, the first MAX_REFUSALS, of `refused` in all. `logs`: of a
    log list, newest first. `seen`: of an accepted command, whether telemetry showed its effect in time; None if there
    is nothing to see, or an older agent does not look.
    """

    id: U32
    outcome: Outcome
    words: Words
    item: U16 | None = None
    code: str = ""
    plan: PackedPlan | None = None
    refusals: Annotated[tuple[ParameterRefusal, ...], msgspec.Meta(max_length=MAX_REFUSALS)] = ()
    refused: U16 = 0
    seen: bool | None = None
    logs: Annotated[tuple[LogEntry, ...], msgspec.Meta(max_length=MAX_LOGS)] | None = None


class PlanOnBoard(msgspec.Struct, frozen=True, tag="plan_on_board", tag_field="type", kw_only=True):
    """Agent to tower, when learnt and on each change. `hash` None: not known; else of the plan as the autopilot has it.

    `plan`: packed by `wire.plans.pack_plan`. `sent_hash`: of the plan that was sent, if the autopilot is known to have
    kept it, with some fields changed. `fit_to_fly` False: the plan may be incomplete; the agent starts no mission.
    """

    kind: PlanKind
    hash: Hash | None
    count: U16 = 0
    plan: PackedPlan | None = None
    sent_hash: Hash | None = None
    fit_to_fly: bool = True


class ParameterCache(msgspec.Struct, frozen=True, tag="parameter_cache", tag_field="type", kw_only=True):
    """Agent to tower, after the welcome, when all parameters are known, and on progress of reading them.

    `hash` (wire.parameters) None: not all are known yet, `count` of `total` are. A tower without a table of that hash
    requests it with a ParametersReadWork. `verified` False: the table is the agent's stored one for this autopilot, and
    is being read again.
    """

    hash: Hash | None
    count: U16
    total: U16
    verified: bool = True
    """Meaningless without a hash."""


class ParameterTable(msgspec.Struct, frozen=True, tag="parameter_table", tag_field="type", kw_only=True):
    """Agent to tower, before the result of a ParametersReadWork. `packed`: `wire.parameters.pack_table`."""

    hash: Hash
    packed: Annotated[bytes, msgspec.Meta(max_length=MAX_PACKED_TABLE_BYTES)]


class ParameterChanged(msgspec.Struct, frozen=True, tag="parameter_changed", tag_field="type", kw_only=True):
    """Agent to tower: a parameter has a new value, whoever set it. `before`, `hash`: of the tables."""

    name: ParameterName
    value: float
    kind: U8
    """MAV_PARAM_TYPE."""
    before: Hash
    hash: Hash


TransactionToAgent = Transaction | CancelTransaction | LeaderPosition | MetadataWanted
TransactionToTower = (
    TransactionProgress
    | TransactionResult
    | PlanOnBoard
    | ParameterCache
    | ParameterTable
    | ParameterChanged
    | MetadataToTower
    | TargetFound
    | ControllerDescribed
)
