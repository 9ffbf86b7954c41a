"""Results of the mission protocol: code names for programs, sentences for users. Pure."""

from typing import Final

from wire.dialect import mavlink
from wire.plan_fields import Effect, KeptFields
from wire.plan_keeping import COUNT, change_words, changes_ahead, differences
from wire.plans import Plan, PlanKind
from wire.transactions import Outcome

PLAN_NAMES: Final = {
    PlanKind.MISSION: "mission",
    PlanKind.FENCE: "fence",
    PlanKind.RALLY: "list of rally points",
}

_SENTENCES: Final[dict[int, str]] = {
    mavlink.MAV_MISSION_ERROR: "the autopilot reports an error and does not say which",
    mavlink.MAV_MISSION_UNSUPPORTED_FRAME: "the autopilot does not know this coordinate frame",
    mavlink.MAV_MISSION_UNSUPPORTED: "the autopilot does not know this command",
    mavlink.MAV_MISSION_NO_SPACE: "the autopilot has no space for so many items",
    mavlink.MAV_MISSION_INVALID: "the autopilot reports an invalid value",
    mavlink.MAV_MISSION_INVALID_PARAM1: "the autopilot reports an invalid parameter 1",
    mavlink.MAV_MISSION_INVALID_PARAM2: "the autopilot reports an invalid parameter 2",
    mavlink.MAV_MISSION_INVALID_PARAM3: "the autopilot reports an invalid parameter 3",
    mavlink.MAV_MISSION_INVALID_PARAM4: "the autopilot reports an invalid parameter 4",
    mavlink.MAV_MISSION_INVALID_PARAM5_X: "the autopilot reports an invalid latitude (x)",
    mavlink.MAV_MISSION_INVALID_PARAM6_Y: "the autopilot reports an invalid longitude (y)",
    mavlink.MAV_MISSION_INVALID_PARAM7: "the autopilot reports an invalid height (z)",
    mavlink.MAV_MISSION_INVALID_SEQUENCE: "the autopilot got an item out of order",
    mavlink.MAV_MISSION_DENIED: "the autopilot denies it now",
    mavlink.MAV_MISSION_OPERATION_CANCELLED: "the autopilot cancelled it",
}


def code_name(result: int) -> str:
    """The name of a MAV_MISSION_RESULT, for instance MAV_MISSION_NO_SPACE."""
    known = mavlink.enums["MAV_MISSION_RESULT"].get(result)
    return str(known.name) if known is not None else f"MAV_MISSION_RESULT {result}"


def sentence(result: int) -> str:
    """The reason, without a full stop."""
    return _SENTENCES.get(result, f"the autopilot answers {code_name(result)}")


def item_words(item: int | None) -> str:
    """Text for `item`, which counts from 0; users count from 1."""
    return "" if item is None else f"item {item + 1}: "


def kept_words(keeping: KeptFields, kind: PlanKind, plan: Plan) -> str:
    """Describes which values of a plan on board the autopilot changed: sentences after a space, or nothing."""
    changed = changes_ahead(keeping, kind, plan)
    flown = [change for change in changed if change.effect > Effect.QUIET and change.field != COUNT]
    if flown:
        more = f" There are {len(flown) - 1} more of these." if len(flown) > 1 else ""
        return f" It is not flown exactly as sent. {change_words(keeping, flown[0])}{more}"
    quiet = sum(change.field != COUNT for change in changed)
    if quiet:
        return f" {keeping.name} keeps {quiet} values differently, with no effect on the flight."
    return ""


def compared(keeping: KeptFields, kind: PlanKind, plan: Plan, on_board: Plan) -> tuple[Outcome, str, int | None]:
    """Returns whether the plan on board is this one; else the first item that differs, from 0."""
    the = PLAN_NAMES[kind]
    different = next(iter(differences(keeping, kind, plan, on_board)), None)
    if different is None:
        return Outcome.DONE, f"The {the} on board is this one.", None
    words = f"The {the} on board is another: they differ first in item {different.item + 1} ({different.field})."
    return Outcome.FAILED, words, different.item
