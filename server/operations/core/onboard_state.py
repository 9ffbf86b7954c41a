"""Plans and parameters on board of one drone, as its agent reports. State and checks; no I/O; takes the time.

An agent is trusted about its own drone only, and only if its reports are consistent: a plan or a table that does not
match its hash is a MalformedMessage, and what was known before stays.
"""

from dataclasses import dataclass
from datetime import datetime
from hashlib import sha256

import msgspec

from server.operations.core.controller_forms import ControllerForms
from server.operations.core.findings import Findings
from server.operations.core.metadata_store import MetadataStore
from server.operations.core.onboard_views import (
    NO_PARAMETERS,
    NO_PLANS,
    OnboardPlanView,
    ParametersStateView,
    PlansView,
)
from wire.control_messages import MalformedMessage
from wire.parameters import Parameter, Table, by_name, table_hash, unpack_table
from wire.plans import Plan, PlanKind, unpack_plan
from wire.transactions import LogEntry, ParameterCache, ParameterChanged, ParameterTable, PlanOnBoard


@dataclass(frozen=True)
class KnownPlan:
    """`packed`: None if the agent reported only the hash. `read_at`: time of the report."""

    packed: bytes | None
    read_at: datetime | None

    def items(self) -> Plan | None:
        return None if self.packed is None else unpack_plan(self.packed)[1]


def checked_plan(kind: PlanKind, packed: bytes, *, hash_: str | None = None, count: int | None = None) -> Plan:
    """The items of a packed plan. Raises MalformedMessage where it is none of this kind, hash and length."""
    try:
        found, items = unpack_plan(packed)
    except ValueError as error:
        raise MalformedMessage(f"no plan: {error}") from None
    right_hash = hash_ is None or sha256(packed).hexdigest()[:16] == hash_
    if found is not kind or not right_hash or (count is not None and count != len(items)):
        raise MalformedMessage("a plan that does not match its description")
    return items


class OnboardState:
    """One for each drone. Keeps the views that browsers get."""

    def __init__(self) -> None:
        self.plans: PlansView = NO_PLANS
        self.parameters = ReportedParameters()
        self.metadata = MetadataStore()
        self.findings = Findings()
        self.controllers = ControllerForms()
        self.logs: tuple[LogEntry, ...] | None = None
        """On board, when the list was read last."""
        self.logs_read_at: datetime | None = None
        self._known: dict[PlanKind, KnownPlan] = {}

    def plan(self, kind: PlanKind) -> tuple[OnboardPlanView, KnownPlan]:
        """What is known of it."""
        view: OnboardPlanView = getattr(self.plans, kind.value)
        return view, self._known.get(kind, KnownPlan(None, None))

    def update_plan(self, reported: PlanOnBoard, at: datetime | None) -> bool:
        """Whether that is anything new. Raises MalformedMessage."""
        packed = reported.plan if reported.hash is not None else None
        if packed is not None:
            checked_plan(reported.kind, packed, hash_=reported.hash, count=reported.count)
        before, known = self.plan(reported.kind)
        if packed is None and reported.hash is not None and reported.hash == before.hash:
            packed = known.packed
        self._known[reported.kind] = KnownPlan(packed, at)
        view = OnboardPlanView(
            kind=reported.kind,
            state="unknown" if reported.hash is None else "known",
            hash=reported.hash,
            sent_hash=reported.sent_hash,
            count=reported.count if reported.hash is not None else 0,
            fit_to_fly=reported.fit_to_fly,
        )
        self.plans = self.plans.model_copy(update={reported.kind.value: view})
        return view != before

    def forget(self) -> None:
        """The agent's link is gone: others may change what is on board. A parameter table stays until a hash
        disagrees."""
        self.plans = NO_PLANS
        self._known.clear()
        self.parameters.forget()
        self.metadata.forget()
        self.controllers.forget()


class ReportedParameters:
    """The parameter table as received, packed, and its changes. Unpacked on request: a thousand drones have 1.5 million
    parameters."""

    def __init__(self) -> None:
        self._told: ParametersStateView = NO_PARAMETERS
        """As the agent reported it."""
        self.read_at: datetime | None = None
        self._packed: bytes | None = None
        self._hash: str | None = None
        self._changes: dict[str, Parameter] = {}

    @property
    def state(self) -> ParametersStateView:
        """The view for browsers: with the hash of a table only once the table is here and can be asked for."""
        return self._told.model_copy(update={"hash": None}) if self.lacks_table else self._told

    def forget(self) -> None:
        """The agent's link is gone. The table stays until a hash disagrees."""
        self._told = NO_PARAMETERS

    def read_again(self, at: datetime) -> None:
        """They were read again. An agent whose table is here already sends nothing but its hash."""
        if not self.lacks_table:
            self.read_at = at

    @property
    def lacks_table(self) -> bool:
        """Whether the agent has a table that is not here."""
        return self._told.hash is not None and self._told.hash != self._hash

    def update_cache(self, reported: ParameterCache) -> bool:
        """Whether that is anything new."""
        before = self.state
        self._told = ParametersStateView(hash=reported.hash, count=reported.count, total=reported.total)
        return self.state != before

    def update_table(self, reported: ParameterTable, at: datetime | None) -> bool:
        """Whether to notify browsers. Raises MalformedMessage."""
        before = self.state
        try:
            table = unpack_table(reported.packed)
        except ValueError as error:
            raise MalformedMessage(str(error)) from None
        if table_hash(table) != reported.hash:
            raise MalformedMessage("a parameter table that does not match its hash")
        self._packed, self._hash, self.read_at = reported.packed, reported.hash, at
        self._changes.clear()
        return self.state != before

    def changed(self, reported: ParameterChanged, at: datetime | None) -> bool:
        """A parameter has another value. Returns whether to notify browsers. Raises MalformedMessage."""
        try:
            parameter = msgspec.convert([reported.name, reported.value, reported.kind], Parameter)
        except msgspec.ValidationError as error:
            raise MalformedMessage(str(error)) from None
        if self._told.hash is None:
            return False
        before = self.state
        if reported.before == self._hash:
            self._changes[reported.name] = parameter
            self._hash, self.read_at = reported.hash, at
        self._told = self._told.model_copy(update={"hash": reported.hash})
        return self.state != before

    def table(self) -> Table | None:
        """All present values, or None if they are not known. Changes that do not match the reported hash make the table
        missing."""
        if self._told.hash is None or self._packed is None or self.lacks_table:
            return None
        table = unpack_table(self._packed)
        if self._changes:
            named = {one.name: one for one in table} | self._changes
            table = by_name(named.values())
            if table_hash(table) != self._hash:
                self._packed = self._hash = None
                self._changes.clear()
                return None
        return table

    def values(self) -> dict[str, float]:
        """The present values by name; empty: not known."""
        return {one.name: one.value for one in self.table() or ()}
