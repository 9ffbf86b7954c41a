"""Whether the plan that was read back is the plan that was sent. Pure.

No autopilot keeps an item as it came. ArduPilot stores heights in centimetres, knows no difference between a frame
and its `_INT` twin, always answers autocontinue 1, and keeps of the parameters of a navigation command just those that
it uses, often as whole numbers. Such a change is told, and is no reason to call the plan another. Everything else is:
the order, the commands, the places, and whatever a DO command was told.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

from wire.plans import PlanItem

HEIGHT_STEP_M: Final = 0.0101
_TWINS: Final = {5: 0, 6: 3, 11: 10}
_NAVIGATION: Final = range(16, 96)
"""MAV_CMD_NAV_*: those whose unused parameters are dropped."""


class Change(NamedTuple):
    """One field that came back otherwise. `harmless`: as autopilots are known to do."""

    item: int
    field: str
    sent: float | None
    kept: float | None
    harmless: bool


def changes(sent: Sequence[PlanItem], kept: Sequence[PlanItem]) -> list[Change]:
    """All differences, in the order of the items. Empty: the same in every bit."""
    found: list[Change] = []
    if len(sent) != len(kept):
        found.append(Change(min(len(sent), len(kept)), "count", len(sent), len(kept), harmless=False))
    for number, (one, other) in enumerate(zip(sent, kept, strict=False)):
        if one != other:
            found += _item_changes(number, one, other)
    return found


def same_plan(sent: Sequence[PlanItem], kept: Sequence[PlanItem]) -> bool:
    """Whether the plan on board is the whole of what was sent."""
    return all(change.harmless for change in changes(sent, kept))


def _item_changes(number: int, one: PlanItem, other: PlanItem) -> list[Change]:
    def change(field: str, sent: float | None, kept: float | None, harmless: bool) -> None:
        if sent != kept:
            found.append(Change(number, field, sent, kept, harmless))

    found: list[Change] = []
    change("command", one.command, other.command, harmless=False)
    change("frame", one.frame, other.frame, _TWINS.get(one.frame, one.frame) == _TWINS.get(other.frame, other.frame))
    for index, (sent, kept) in enumerate(zip(one.params, other.params, strict=True), start=1):
        change(f"param{index}", sent, kept, _harmless_parameter(one.command, sent, kept))
    change("x", one.x, other.x, harmless=False)
    change("y", one.y, other.y, harmless=False)
    height_step_m = max(HEIGHT_STEP_M, abs(one.z) * 2**-22)
    change("z", one.z, other.z, abs(one.z - other.z) <= height_step_m)
    change("autocontinue", one.autocontinue, other.autocontinue, other.autocontinue == 1)
    return found


def _harmless_parameter(command: int, sent: float | None, kept: float | None) -> bool:
    if sent is None:
        return kept == 0.0
    if kept is None:
        return sent == 0.0
    if command not in _NAVIGATION:
        return False
    return kept == 0.0 or (kept == int(kept) and abs(sent - kept) < 1.0)
