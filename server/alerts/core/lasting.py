"""Turns findings that come and go into conditions that begin and end, by the delays of their rules. Takes `now`.

quiet --(found)--> waiting --(for opens_after_s)--> OPEN --(not found)--> ending --(for closes_after_s)--> quiet
"""

from collections.abc import Mapping
from enum import Enum
from typing import NamedTuple

from server.alerts.core.finding import Finding, Not
from server.alerts.core.rules import BY_NAME, Rule

Key = tuple[str, str]
"""The name of a rule, and what of several it is about; usually empty."""


class Change(Enum):
    OPENED = "opened"
    REWORDED = "reworded"
    CLOSED = "closed"


class Changed(NamedTuple):
    """`words` are empty at the end."""

    key: Key
    change: Change
    words: str


class Lasting:
    """The conditions of one drone."""

    __slots__ = ("_ending", "open", "waiting")

    def __init__(self) -> None:
        self.open: dict[Key, str] = {}
        """The words of what is open."""
        self.waiting: dict[Key, float] = {}
        """Since when that is found which is not open yet."""
        self._ending: dict[Key, float] = {}

    @property
    def idle(self) -> bool:
        """Nothing is open, and nothing is about to be."""
        return not self.open and not self.waiting

    @property
    def steady(self) -> bool:
        """No delay runs: with the same findings, time alone opens and closes nothing."""
        return not self.waiting and not self._ending

    def restore(self, key: Key, words: str) -> None:
        """It was open before the tower restarted."""
        self.open[key] = words

    def forget(self, key: Key) -> None:
        """Nothing is known of it."""
        self.open.pop(key, None)

    def take(self, rule: Rule, subject: str, found: Finding, now: float) -> Changed | None:
        """What is found of one rule now."""
        key = (rule.name, subject)
        if isinstance(found, str):
            return self._found(rule, key, found, now)
        if found is Not.SO:
            return self._not_found(rule, key, now)
        self.waiting.pop(key, None)
        self._ending.pop(key, None)
        return None

    def take_all(self, rules: frozenset[str], found: Mapping[Key, str], now: float) -> list[Changed]:
        """Everything that is found of these rules now, by subject: what is not among it, is not so."""
        known = [key for key in (*self.open, *self.waiting) if key[0] in rules and key not in found]
        results: dict[Key, Finding] = dict.fromkeys(known, Not.SO)
        results.update(found)
        taken = (self.take(BY_NAME[key[0]], key[1], finding, now) for key, finding in results.items())
        return [one for one in taken if one is not None]

    def _found(self, rule: Rule, key: Key, words: str, now: float) -> Changed | None:
        self._ending.pop(key, None)
        known = self.open.get(key)
        if known is not None:
            if not rule.follows or known == words:
                return None
            self.open[key] = words
            return Changed(key, Change.REWORDED, words)
        since = self.waiting.setdefault(key, now)
        if now - since < rule.opens_after_s:
            return None
        del self.waiting[key]
        self.open[key] = words
        return Changed(key, Change.OPENED, words)

    def _not_found(self, rule: Rule, key: Key, now: float) -> Changed | None:
        self.waiting.pop(key, None)
        if key not in self.open:
            return None
        since = self._ending.setdefault(key, now)
        if now - since < rule.closes_after_s:
            return None
        del self._ending[key], self.open[key]
        return Changed(key, Change.CLOSED, "")
