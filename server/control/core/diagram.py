"""Draws the lease table as a Mermaid state diagram for docs/control.md, by asking the table itself. Pure.

`python -m server.control.core.diagram` prints it.
"""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Final

from server.control.core.lease import Actor, Changed, Event, Lease, Order, Phase, decide
from wire.ids import UserId

_OPERATOR: Final = UserId(1)
_ADMIN: Final = UserId(2)
_SECOND_ADMIN: Final = UserId(3)
_HELD: Final = Lease(holder=_OPERATOR)
_TAKEN: Final = Lease(holder=_ADMIN, taken_from=_OPERATOR)

_LEASES: Final = (Lease(), _HELD, replace(_HELD, assistant=_ADMIN), _TAKEN, replace(_TAKEN, offered=True))
_ACTORS: Final = (
    Actor(_OPERATOR, is_owner=True, sticks_centred=True),
    Actor(_ADMIN, is_admin=True),
    Actor(_SECOND_ADMIN, is_admin=True),
    Actor(None, is_tower=True),
)
_NAMES: Final = {
    Phase.FREE: "Free, nobody has the controls",
    Phase.HELD: "Held, somebody flies, perhaps assisted",
    Phase.TAKEN: "Taken, an admin flies and the operator is shut out",
    Phase.OFFERED: "Offered, the drone holds until the operator accepts",
}
_ORDERS: Final = {
    Order.HOLD: "hold",
    Order.HOLD_IF_FLOWN_BY_HAND: "hold if by hand",
}


def transitions() -> Iterator[tuple[Phase, Event, Phase, tuple[Order, ...]]]:
    """All transitions of the table."""
    for lease, event, actor in product(_LEASES, Event, _ACTORS):
        outcome = decide(lease, event, actor)
        if isinstance(outcome, Changed):
            yield lease.phase, event, outcome.lease.phase, outcome.orders


def draw() -> str:
    """The diagram as Mermaid text."""
    arrows: defaultdict[tuple[Phase, Phase], list[str]] = defaultdict(list)
    for before, event, after, orders in transitions():
        label = event.value if not orders else f"{event.value} ({', '.join(_ORDERS[order] for order in orders)})"
        if label not in arrows[before, after]:
            arrows[before, after].append(label)
    lines = ["stateDiagram-v2", "    [*] --> free"]
    lines += [f"    {phase.value} : {name}" for phase, name in _NAMES.items()]
    for (before, after), labels in arrows.items():
        lines.append(f"    {before.value} --> {after.value} : {'<br/>'.join(labels)}")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(draw(), end="")
