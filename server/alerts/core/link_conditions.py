"""Conditions of links and people: who is not heard, who flies, what the drone does by itself. Pure."""

from typing import Final

from server.alerts.core.facts import Facts
from server.alerts.core.finding import Finding, Not
from wire.autopilots.profile import FlightTask
from wire.open_holds import Lost, LostAction, LostPhase
from wire.signing_key import Signing

DOES: Final = {
    LostAction.RETURN: "returns",
    LostAction.LAND: "lands",
    LostAction.CONTINUE: "goes on with its mission, or stays",
    LostAction.STAY: "stays until the battery is needed for the way home",
}
_WAS: Final = {
    FlightTask.MISSION: "flew its mission",
    FlightTask.RETURN: "was returning",
    FlightTask.LANDING: "was landing",
    FlightTask.BY_HAND: "was flown by hand",
}


_TOLD_BY_OTHERS: Final = (LostPhase.COUNTING, LostPhase.ASKING, LostPhase.DONE)
"""Of `lost-action-counting` and `lost-action`."""


def link_lost_in_air(facts: Facts, is_open: bool) -> Finding:
    if facts.silence == "link" and facts.airborne:
        height = "" if facts.height_m is None else f" at {facts.height_m:.0f} m"
        return f"{facts.name} lost its link in the air{height}. {_last_words(facts)}"
    return _unless_silent(facts)


def link_lost_on_ground(facts: Facts, is_open: bool) -> Finding:
    if facts.silence == "link" and facts.armed and not facts.airborne:
        return f"{facts.name} lost its link on the ground with its motors armed."
    return _unless_silent(facts)


def autopilot_silent(facts: Facts, is_open: bool) -> Finding:
    if facts.silence == "autopilot" and facts.airborne:
        return f"The autopilot of {facts.name} is silent in the air. Its agent is still connected."
    return Not.SO if not facts.silence else Not.KNOWN


def deaf_autopilot(facts: Facts, is_open: bool) -> Finding:
    if facts.silence or facts.hears_agent is None:
        return Not.KNOWN
    if facts.hears_agent:
        return Not.SO
    if facts.signing is Signing.NO_KEY:
        return (
            f"The autopilot of {facts.name} does not answer its agent: it signs, and its agent has no key. No command "
            "reaches it, and it cannot be held."
        )
    return f"The autopilot of {facts.name} does not answer its agent. No command reaches it, and it cannot be held."


def noisy(facts: Facts, is_open: bool) -> Finding:
    if facts.noise:
        return f"{facts.name} sends {facts.noise}."
    return Not.SO if not facts.silence else Not.KNOWN


def wrong_signing_key(facts: Facts, is_open: bool) -> Finding:
    if facts.silence == "link":
        return Not.KNOWN
    if facts.signing is not Signing.WRONG_KEY:
        return Not.SO
    return f"The autopilot of {facts.name} does not sign with the key of its agent, which takes nothing from it."


def other_autopilot(facts: Facts, is_open: bool) -> Finding:
    if facts.other_systems:
        named = " and ".join(str(one) for one in facts.other_systems)
        return f"Another autopilot, system {named}, is on the line of {facts.name}. It is not shown, flown or held."
    return Not.SO if not facts.silence else Not.KNOWN


def hold_unconfirmed(facts: Facts, is_open: bool) -> Finding:
    if facts.hold_unconfirmed is None:
        return Not.SO if not facts.silence else Not.KNOWN
    why = f": {facts.hold_unconfirmed}" if facts.hold_unconfirmed else ""
    return f"{facts.name} did not confirm its hold{why}."


def on_hold(facts: Facts, is_open: bool) -> Finding:
    hold = facts.hold
    if hold is None or not hold.open:
        return Not.SO if not facts.silence else Not.KNOWN
    why = f": {facts.hold_reason}" if facts.hold_reason else ""
    return f"{facts.name} is on hold{why}."


def lost_action_counting(facts: Facts, is_open: bool) -> Finding:
    hold = facts.hold
    if hold is None or hold.lost is None or hold.phase is not LostPhase.COUNTING:
        return Not.SO if not facts.silence else Not.KNOWN
    is_person = hold.lost is Lost.PERSON
    why = f"{facts.name} has lost the tower."
    if is_person:
        because = hold.nobody_because
        why = f"Nobody flies {facts.name} ({because})." if because else f"Nobody flies {facts.name}."
    when = "soon" if hold.due_at is None else f"at {hold.due_at:%H:%M:%S} UTC"
    unless = ', unless somebody flies it or says "stay"' if is_person and hold.action is not LostAction.STAY else ""
    return f"{why} It {_action_words(hold.action)} {when}{unless}."


def lost_action(facts: Facts, is_open: bool) -> Finding:
    hold = facts.hold
    if hold is None or hold.lost is None or hold.phase not in (LostPhase.ASKING, LostPhase.DONE):
        return Not.SO if not facts.silence else Not.KNOWN
    because = hold.nobody_because
    why = "it had lost the tower"
    if hold.lost is Lost.PERSON:
        why = f"nobody flew it ({because})" if because else "nobody flew it"
    return f"{facts.name} acts by itself. It {_action_words(hold.action)}: {why}."


def unattended(facts: Facts, is_open: bool) -> Finding:
    if facts.silence:
        return Not.KNOWN
    if facts.airborne is True and facts.held_by is None:
        if facts.hold is not None and facts.hold.phase in _TOLD_BY_OTHERS:
            return Not.SO  # one danger, one alert
        return f"{facts.name} is in the air, and nobody has the controls."
    return Not.SO if facts.airborne is not None else Not.KNOWN


def armed_unattended(facts: Facts, is_open: bool) -> Finding:
    if facts.silence:
        return Not.KNOWN
    is_held = facts.hold is not None and facts.hold.open
    if facts.armed and facts.airborne is False and (facts.held_by is None or is_held):
        return f"{facts.name} stands on the ground with its motors armed, and nobody flies it."
    return Not.SO if facts.armed is not None else Not.KNOWN


def black_box_failing(facts: Facts, is_open: bool) -> Finding:
    if facts.black_box_problem:
        return f"The black box of {facts.name} records nothing: {facts.black_box_problem}."
    return Not.SO if not facts.silence else Not.KNOWN


def _unless_silent(facts: Facts) -> Finding:
    """A link that is back closes what its loss opened."""
    return Not.SO if facts.silence != "link" or facts.airborne is not None else Not.KNOWN


def _action_words(action: LostAction | None) -> str:
    return "acts by itself" if action is None else DOES[action]


def _last_words(facts: Facts) -> str:
    """What it did last and what comes next, as far as its settings tell."""
    was = _WAS.get(facts.task) if facts.task is not None else None
    if facts.hold is not None and facts.hold.open:
        was = f"held in {facts.hold.mode}"
    if was is None:
        was = f"was in {facts.mode}" if facts.mode else ""
    last = f"It {was}" if was else "It is not known what it did"
    if facts.task in (FlightTask.RETURN, FlightTask.LANDING):
        return f"{last}, and should go on with that."
    if facts.lost_action is None:
        return f"{last}. It is watched only: what comes next is up to its autopilot."
    after = f"after {facts.lost_action_s:.0f} s without the tower, if its agent is alive"
    does = DOES[facts.lost_action]
    if facts.lost_action in (LostAction.RETURN, LostAction.LAND):
        holds = "it holds, then " if facts.task is FlightTask.BY_HAND else ""
        return f"{last}; {holds}it {does} {after}."
    return f"{last}; it {does}, if its agent is alive."
