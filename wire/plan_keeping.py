"""Compares the plan read back with the plan sent, by what the autopilot keeps of each item. Pure.

One source for agent, tower and console: the agent compares what came back, the tower predicts what will not be kept.
The tables with their sources: `wire/autopilots/*_plans.py`.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

from wire.autopilots.registry import FAMILIES
from wire.plan_fields import Effect, ItemKept, KeptFields, becomes, fields_of, item_of
from wire.plan_verbatim import Verbatim
from wire.plans import Plan, PlanItem, PlanKind

COUNT: Final = "count"


def keeping_of(autopilot: int, vehicle_type: int, flight_sw_version: int = 0) -> KeptFields:
    """Returns the table for a MAV_AUTOPILOT, a MAV_TYPE and the firmware that AUTOPILOT_VERSION names."""
    family = FAMILIES.get(autopilot)
    return Verbatim() if family is None else family.keeping(vehicle_type, family.release_of(flight_sw_version))


def to_send(keeping: KeptFields, kind: PlanKind, plan: Sequence[PlanItem]) -> Plan:
    """Returns the plan as it goes to the autopilot: values that it would truncate are rounded first."""
    return tuple(keeping.to_send(kind, item) for item in plan)


def _kept(keeping: KeptFields, kind: PlanKind, item: PlanItem) -> ItemKept:
    """Returns what the autopilot keeps of an item, with the height as adapted for sending."""
    kept = keeping.kept(kind, item)
    going = keeping.to_send(kind, item)
    if going == item:
        return kept
    back = keeping.kept(kind, going).fields["z"].value
    return kept._replace(fields={**kept.fields, "z": becomes(item.z, back, Effect.QUIET)})


class Change(NamedTuple):
    """A field that comes back changed. `item` from 0. `kept` of a refused field: as it was sent.

    For the field "count": `item` is the first item without room on the autopilot, `kept` is the number of items with
    room.
    """

    item: int
    field: str
    sent: float | None
    kept: float | None
    effect: Effect


def changes_ahead(keeping: KeptFields, kind: PlanKind, plan: Sequence[PlanItem]) -> list[Change]:
    """Returns what the autopilot will not keep: lack of room first, then in the order of the items.

    Shown before a plan is sent.
    """
    found = []
    most = keeping.room[kind]
    if len(plan) > most:
        found.append(Change(most, COUNT, len(plan), most, Effect.REFUSED))
    for number, item in enumerate(plan):
        kept = _kept(keeping, kind, item).fields
        for field, sent in fields_of(item).items():
            if kept[field].effect is not Effect.SAME:
                found.append(Change(number, field, sent, kept[field].value, kept[field].effect))
    return found


def as_kept(keeping: KeptFields, kind: PlanKind, plan: Sequence[PlanItem]) -> Plan:
    """The plan as it comes back; refused fields as they were sent."""
    items = (_kept(keeping, kind, item).fields for item in plan)
    return tuple(item_of({name: one.value for name, one in item.items()}) for item in items)


def differences(
    keeping: KeptFields, kind: PlanKind, sent: Sequence[PlanItem], got: Sequence[PlanItem], *, exactly: bool = False
) -> list[Change]:
    """Returns where `got` differs from what must come back of `sent`; `kept` is the value in `got`. Empty: the same
    plan.

    `exactly`: heights too, which otherwise may differ by the autopilot's step.
    """
    found: list[Change] = []
    if len(sent) != len(got):
        found.append(Change(min(len(sent), len(got)), COUNT, len(sent), len(got), Effect.FLIGHT))
    for number, (one, other) in enumerate(zip(sent, got, strict=False)):
        kept = _kept(keeping, kind, one)
        back = fields_of(other)
        for field, value in fields_of(one).items():
            step_m = kept.height_step_m if field == "z" and not exactly else 0.0
            if not kept.fields[field].comes_back_as(back[field], within=step_m):
                found.append(Change(number, field, value, back[field], Effect.FLIGHT))
    return found


def same_plan(
    keeping: KeptFields, kind: PlanKind, sent: Sequence[PlanItem], got: Sequence[PlanItem], *, exactly: bool = False
) -> bool:
    """Returns whether the plan on board is the whole plan sent, as its autopilot keeps it."""
    return not differences(keeping, kind, sent, got, exactly=exactly)


_FIELD_WORDS: Final = {
    "command": "the command",
    "frame": "the frame",
    "x": "x (latitude)",
    "y": "y (longitude)",
    "z": "the height (z)",
    **{f"param{number}": f"parameter {number}" for number in range(1, 5)},
}


def change_words(keeping: KeptFields, change: Change) -> str:
    """Describes a predicted change in one or two sentences."""
    if change.field == COUNT:
        room = f"{keeping.name} has room for {change.kept:.0f} on the usual boards"
        return f"{change.sent:.0f} items: {room}. An autopilot with less space refuses all of them."
    what, sent, kept = (
        _FIELD_WORDS.get(change.field, change.field),
        number_words(change.sent),
        number_words(change.kept),
    )
    if change.field == "command" and change.sent in keeping.lacks:
        return f"Item {change.item + 1}: this release of {keeping.name} does not know command {sent}."
    if change.effect is Effect.REFUSED:
        return f"Item {change.item + 1}: {keeping.name} does not take {sent} as {what}."
    return f"Item {change.item + 1}: {keeping.name} keeps {what} as {kept}, not {sent}."


def number_words(value: float | None) -> str:
    """Formats a number for people; NaN is "open"."""
    return "open" if value is None else f"{value:.9g}"
