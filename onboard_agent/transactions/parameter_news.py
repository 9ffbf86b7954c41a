"""Reports of the parameter table for the tower: whole by its hash, or change by change. No I/O; takes `now`.

Rules, each tested:

- A few changes are reported one by one, each with the hashes before and after it; many at once as another table.
- At most once in SEND_EVERY_S, and nothing twice.
- A new tower first gets the present state.
"""

from typing import Final

import msgspec

from wire.parameters import Parameter, Table, by_name, table_hash
from wire.transactions import ParameterCache, ParameterChanged

SEND_EVERY_S: Final = 0.5
MAX_CHANGES: Final = 4
"""Each costs a hash over the whole table, on a slow computer some milliseconds, and sticks may pass."""

News = ParameterCache | ParameterChanged


class ParameterNews:
    """Keeps the table. `learnt`, `put` and `reading` change what there is to tell, `due` tells it."""

    def __init__(self) -> None:
        self.values: dict[str, Parameter] = {}
        """By name, as far as they are known: nothing, or a whole table."""
        self.verified = False
        """Whether the autopilot itself has sent all of them since it connected."""
        self._progress = (0, 0)
        self._hash: str | None = None
        self._changed: dict[str, None] = {}
        self._sent_values: dict[str, Parameter] = {}
        self._sent: ParameterCache | None = None
        self._sent_at = float("-inf")

    @property
    def table(self) -> Table:
        """As it is."""
        return by_name(self.values.values())

    @property
    def hash(self) -> str | None:
        """Hash of the table; None if nothing is known."""
        if self._hash is None and self.values:
            self._hash = table_hash(self.table)
        return self._hash

    @property
    def is_sent(self) -> bool:
        """Whether the tower knows anything of them."""
        return self._sent is not None

    def forget(self) -> None:
        """Nothing that was known holds."""
        self.learnt((), verified=False)

    def doubt(self) -> None:
        """The table may have changed: it counts as remembered until it is read again."""
        self.verified = False
        self._progress = (0, 0)

    def learnt(self, table: Table, *, verified: bool) -> None:
        """The whole table."""
        self.values = {one.name: one for one in table}
        self.verified = verified
        self._progress = (0, 0)
        self._changed = {name: None for name, one in self.values.items() if self._sent_values.get(name) != one}
        self._hash = None

    def put(self, parameter: Parameter) -> bool:
        """A value arrived. Returns whether it is new; without a table it is not kept."""
        if not self.values or self.values.get(parameter.name) == parameter:
            return False
        self.values[parameter.name] = parameter
        self._changed[parameter.name] = None
        self._hash = None
        return True

    def reading(self, done: int, total: int) -> None:
        """Progress of a list: this many have arrived."""
        self._progress = (done, total)

    def resend(self) -> None:
        """The tower may know nothing."""
        self._sent = None
        self._sent_at = float("-inf")

    def due(self, now: float, *, at_once: bool = False) -> list[News]:
        """The reports due now. `at_once`: whatever the time of the last report."""
        if now - self._sent_at < SEND_EVERY_S and not at_once:
            return []
        news: list[News] = []
        if self._sent is not None and self._sent.hash is not None and 0 < len(self._changed) <= MAX_CHANGES:
            news += self._changes(self._sent.hash)
        done, total = (len(self.values),) * 2 if self.values else self._progress
        cache = ParameterCache(hash=self.hash, count=done, total=total, verified=self.verified or not self.values)
        nothing = self._sent is None and self.hash is None and not total
        if not nothing and cache != self._sent:
            if self._sent is None or cache.hash != self._sent.hash:
                self._sent_values = dict(self.values)
                self._changed.clear()
            self._sent = cache
            news.append(cache)
        if news:
            self._sent_at = now
        return news

    def _changes(self, before: str) -> list[News]:
        """Changes one by one, unless the table differs by more than these: then none, and it is reported as another
        table."""
        values = dict(self._sent_values)
        changes: list[News] = []
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
