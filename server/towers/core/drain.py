"""The order in which a tower that ends its work sends its drones elsewhere. No I/O; takes `now`.

    the drone                                      what happens
    is not flown by hand                           asked at once, MAX_ASKED at the same time
    is flown by hand, all is well                  asked when no other drone is left, one after the other
    is flown by hand, and held, fenced, assisted   waits: its next tower would have to make it hold
    has an agent that cannot move                  its link is closed, unless somebody flies it by hand

An agent leaves its tower only after another one has taken it. A drone that is asked stays where it is until then.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Final

from wire.ids import LinkId

MAX_ASKED: Final = 8
ASK_AGAIN_AFTER_S: Final = 3.0
"""An agent that is still here by then has found no other tower, or has lost the message."""


@dataclass(frozen=True)
class Linked:
    """A drone with a link to this tower. `settled`: neither held nor fenced nor assisted."""

    link_id: LinkId
    name: str
    by_hand: bool
    settled: bool
    can_move: bool


class Step(Enum):
    ASK = "ask"
    CLOSE = "close"


class Drain:
    """One for a tower that ends its work."""

    def __init__(self) -> None:
        self._asked: dict[LinkId, float] = {}

    def due(self, links: Iterable[Linked], now: float) -> list[tuple[LinkId, Step]]:
        """What to do now; call it several times a second with all links that are left."""
        left = list(links)
        ids = {one.link_id for one in left}
        self._asked = {link_id: at for link_id, at in self._asked.items() if link_id in ids}
        free = [one for one in left if not one.by_hand]
        if free:
            steps = [(one.link_id, Step.CLOSE) for one in free if not one.can_move]
            return steps + [(one, Step.ASK) for one in self._ask([one for one in free if one.can_move], MAX_ASKED, now)]
        ready = [one for one in left if one.can_move and (one.settled or one.link_id in self._asked)]
        return [(one, Step.ASK) for one in self._ask(ready, 1, now)]

    def _ask(self, ready: list[Linked], at_once: int, now: float) -> list[LinkId]:
        pending = [one for one in ready if now - self._asked.get(one.link_id, float("-inf")) < ASK_AGAIN_AFTER_S]
        # Who was asked the longest ago, or never, comes first: one that cannot move must not keep the others.
        others = sorted(
            (one for one in ready if one not in pending), key=lambda one: self._asked.get(one.link_id, float("-inf"))
        )
        chosen = [one.link_id for one in others[: max(0, at_once - len(pending))]]
        self._asked.update(dict.fromkeys(chosen, now))
        return chosen

    @staticmethod
    def in_words(links: Iterable[Linked], browsers: int) -> str:
        """How far it is, for people."""
        left = list(links)
        hands = [one for one in left if one.by_hand]
        parts = []
        if len(left) > len(hands):
            parts.append(f"{len(left) - len(hands)} drones to move")
        if hands:
            names = ", ".join(one.name for one in hands[:5])
            stuck = [one for one in hands if not one.can_move]
            parts.append(f"flown by hand: {names}" + (f" ({stuck[0].name} cannot move in flight)" if stuck else ""))
        if browsers:
            parts.append(f"{browsers} browsers to move")
        return "; ".join(parts) or "done"
