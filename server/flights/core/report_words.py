"""Entries of the index of a flight in words, as the console says them. Pure; plain text, not escaped."""

from __future__ import annotations

from typing import Any, Final

_STEPS: Final = {
    "ordered": "ordered",
    "sticks_centred": "sticks centred",
    "mode_requested": "mode requested",
    "mode_acknowledged": "mode acknowledged",
    "confirmed": "confirmed by the autopilot",
    "not_needed": "not needed",
    "unconfirmed": "NOT CONFIRMED",
}
_CAUSES: Final = {
    "order": "ordered by the tower",
    "pilot-lost": "the pilot or the tower was lost",
    "sticks-stale": "the sticks stopped or came too late",
}
_CONTROL: Final = {
    "acquired": "took control of",
    "released": "released the controls of",
    "taken": "TOOK control of",
    "given": "gives back the controls of",
    "accepted": "accepted the controls of",
    "assisting": "assists with",
    "assist_ended": "no longer assists with",
    "revoked": "revoked the controls of",
    "expired": "let the controls expire of",
}


def name_of(who: object) -> str:
    """Empty: nobody."""
    return str(who.get("name", "")) if isinstance(who, dict) else ""


def command_words(entry: dict[str, Any]) -> str:
    """Returns what was commanded."""
    what = entry.get("about") or entry.get("work") or entry.get("command") or "a command"
    count = entry.get("count")
    times = f", {count} times" if isinstance(count, int) and count > 1 else ""
    return f"{what}{times}" + (" (as frames)" if entry.get("way") == "frames" else "")


def told_words(entry: dict[str, Any], drone: str) -> str:
    """Returns one line for people; empty for what is no event of its own. `drone`: its name."""
    match entry.get("kind"):
        case "armed":
            return f"{drone} armed; {name_of(entry.get('holder')) or 'nobody'} has the controls"
        case "disarmed":
            return f"{drone} disarmed"
        case "end":
            words = entry.get("words")
            return f"The recording ended: {words}" if words else "The recording ended"
        case "control":
            return _control(entry, drone)
        case "turn":
            return f"Now the frames of {name_of(entry.get('user'))} pass"
        case "hold":
            return _hold(entry)
        case "command":
            answer = entry.get("answer") or entry.get("state")
            who = name_of(entry.get("by")) or "The tower"
            return f"{who}: {command_words(entry)}" + (f" ({answer})" if answer else "")
        case "sticks":
            return f"{name_of(entry.get('by'))} moves the sticks"
        case "sticks_rest":
            return f"The sticks of {name_of(entry.get('by'))} rest"
        case "alert":
            by = name_of(entry.get("by"))
            state = f" {entry['state']}" if entry.get("state") else ""
            return f"Alert{state}{f' by {by}' if by else ''}: {entry.get('words') or entry.get('what')}"
        case "holder":
            is_over = entry.get("what") == "HolderExpired"
            return "The holder was gone for too long" if is_over else "The holder was not heard any more"
        case "link_lost":
            return f"{drone} was not heard any more"
        case "link_back":
            return f"{drone} was heard again"
        case "video":
            return "A recording of video began or ended"
        case "notice" | "rehearsal":
            return str(entry.get("text", ""))
        case _:
            return ""


def _control(entry: dict[str, Any], drone: str) -> str:
    who = name_of(entry.get("by")) or "The tower"
    what = _CONTROL.get(str(entry.get("event")), f"changed ({entry.get('event')}) the controls of")
    why = f": {entry['reason']}" if entry.get("reason") else ""
    return f"{who} {what} {drone}{why}; {name_of(entry.get('holder')) or 'nobody'} has the controls"


def _hold(entry: dict[str, Any]) -> str:
    step, detail = str(entry.get("step", "")), str(entry.get("detail") or "")
    cause = str(entry.get("cause", ""))
    why = f" ({_CAUSES.get(cause, cause)})" if step == "ordered" or cause != "order" else ""
    return f"Hold {_STEPS.get(step, step)}{why}" + (f": {detail}" if detail else "")
