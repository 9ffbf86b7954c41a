"""Reports the parameter table to the tower: as a whole by its hash, or change by change. No I/O; takes `now`.

Rules, each tested:
- A few changes are reported one by one, each with the hash before and after it; many changes count as another table.
- Reports are sent at most once in SEND_EVERY_S, and never twice.
- A new tower first receives the current state.
"""

from typing import Final

import msgspec

from wire.parameters import Parameter, Table, by_name, table_hash
from wire.transactions import ParameterCache, ParameterChanged

SEND_EVERY_S: Final = 0.5
MAX_CHANGES: Final = 4
"""Each change hashes the whole table, which takes some milliseconds on a slow computer and may delay sticks."""

ParameterReport = ParameterCache | ParameterChanged


class ParameterReports:
    """Keeps the table. `learnt`, `put` and `reading` change what to report, `due` reports it."""

    def __init__(self) -> None:
        self.values: dict[str, Parameter] = {}
        """By name: empty, or a complete table."""
        self.verified = False
        """Whether the autopilot itself has sent the whole table since it came."""
        self._progress = (0, 0)
        self._hash: str | None = None
        self._changed: dict[str, None] = {}
        self._sent_values: dict[str, Parameter] = {}
        self._sent: ParameterCache | None = None
        self._sent_at = float("-inf")

    @property
    def table(self) -> Table:
        """The current table."""
        return by_name(self.values.values())

    @property
    def hash(self) -> str | None:
        """Hash of the table; None if nothing is known."""
        if self._hash is None and self.values:
            self._hash = table_hash(self.table)
        return self._hash

    @property
    def is_sent(self) -> bool:
        """Whether anything was reported to the tower."""
        return self._sent is not None

    def forget(self) -> None:
        """Discards the table."""
        self.learnt((), verified=False)

    def doubt(self) -> None:
        """The table may have changed: it counts as remembered until it is received again."""
        self.verified = False
        self._progress = (0, 0)

    def learnt(self, table: Table, *, verified: bool) -> None:
        """Replaces the whole table."""
        self.values = {one.name: one for one in table}
        self.verified = verified
        self._progress = (0, 0)
        self._changed = {name: None for name, one in self.values.items() if self._sent_values.get(name) != one}
        self._hash = None

    def put(self, parameter: Parameter) -> bool:
        """Takes one received parameter. Returns whether it is new; without a table it is not kept."""
        if not self.values or self.values.get(parameter.name) == parameter:
            return False
        self.values[parameter.name] = parameter
        self._changed[parameter.name] = None
        self._hash = None
        return True

    def reading(self, done: int, total: int) -> None:
        """Takes the progress of a list that is being read."""
        self._progress = (done, total)

    def resend(self) -> None:
        """The tower may know nothing: sends the state again."""
        self._sent = None
        self._sent_at = float("-inf")

    def due(self, now: float, *, at_once: bool = False) -> list[ParameterReport]:
        """Returns the reports to send now. `at_once` ignores SEND_EVERY_S."""
        if now - self._sent_at < SEND_EVERY_S and not at_once:
            return []
        reports: list[ParameterReport] = []
        if self._sent is not None and self._sent.hash is not None and 0 < len(self._changed) <= MAX_CHANGES:
            reports += self._changes(self._sent.hash)
        done, total = (len(self.values),) * 2 if self.values else self._progress
        cache = ParameterCache(hash=self.hash, count=done, total=total, verified=self.verified or not self.values)
        nothing = self._sent is None and self.hash is None and not total
        if not nothing and cache != self._sent:
            if self._sent is None or cache.hash != self._sent.hash:
                self._sent_values = dict(self.values)
                self._changed.clear()
            self._sent = cache
            reports.append(cache)
        if reports:
            self._sent_at = now
        return reports

    def _changes(self, before: str) -> list[ParameterReport]:
        """Returns the changes one by one; nothing if the table differs by more, and so counts as another table."""
        values = dict(self._sent_values)
        changes: list[ParameterReport] = []
        for name in self._changed:
            parameter = values[name] = self.values[name]
            after = table_hash(by_name(values.values()))
            changes.append(
                ParameterChanged(name=name, value=parameter.value, kind=parameter.kind, before=before, hash=after)
            )
            before = after
        if before != self.hash or self._sent is None:
            return []
        self._sent_values = values
        self._changed.clear()
        self._sent = msgspec.structs.replace(self._sent, hash=before)
        return changes
