"""What people were told of one drone after a moment: alerts, steps and promises of a hold, notices, in order."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from bench.person import Event, Person
from bench.squadron import FlownDrone


@dataclass(frozen=True, slots=True)
class Told:
    """`at`: seconds after the moment. `code`: the alert's rule, `hold` with the step or phase, or the notice's code."""

    at: float
    code: str
    words: str


def told(drone: FlownDrone, person: Person, since: float) -> list[Told]:
    """Each once. Times are those of the loop, as in `since`."""
    found: dict[str, Told] = {}
    for at, event in drone.events_since(person, since):
        for code, words in _in_words(event):
            found.setdefault(code, Told(at - since, code, words))
    for at, event in person.events:
        if at >= since and event["type"] == "alert" and event["alert"]["drone_id"] == drone.drone_id:
            alert = event["alert"]
            if alert["closed_at"] is None:
                found.setdefault(
                    alert["rule"], Told(at - since, alert["rule"], f"{alert['severity']}: {alert['words']}")
                )
    return sorted(found.values(), key=lambda one: one.at)


def _in_words(event: Event) -> Iterable[tuple[str, str]]:
    if event["type"] == "hold":
        yield f"hold {event['step']}", event["detail"]
    elif event["type"] == "notice":
        yield event["code"], event["text"]
    elif event["type"] == "drone":
        hold: dict[str, Any] | None = event["drone"].get("hold")
        if hold is not None and hold.get("open") is not False:
            phase, action = hold.get("phase"), hold.get("action")
            yield f"hold {phase} {action}", ""


def first(messages: Iterable[Told], *codes: str) -> float:
    """Seconds until the first of these; NaN: none came."""
    return min((one.at for one in messages if one.code in codes), default=math.nan)


def in_short(messages: Iterable[Told], count: int = 6) -> str:
    return "; ".join(f"{one.at:.1f} s {one.code}" for one in list(messages)[:count])
