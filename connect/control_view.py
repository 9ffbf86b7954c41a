"""Follows the tower's events about one drone and turns them into sentences for the terminal. No I/O.

Events in, replies and sentences out. Its only decision is whether the user has the controls.
"""

from collections import Counter
from typing import Any, Final

import msgspec

from wire.ids import DroneId

REPEATED_AFTER_S: Final = 10.0
"""Minimum interval between repetitions of a sentence, which then includes the count."""

MAX_REMEMBERED: Final = 64

_DID: Final = {
    "acquired": "has the controls",
    "released": "released the controls",
    "taken": "took control",
    "given": "gives the controls back",
    "accepted": "accepted the controls",
    "assisting": "assists: those commands win for as long as they come",
    "assist_ended": "ended the assistance",
}
_STEPS: Final = {"ordered", "confirmed", "unconfirmed"}


class ControlView:
    """Feed it text messages of the live channel; take its sentences."""

    def __init__(self, drone_id: DroneId, name: str) -> None:
        self.name = name
        self.user_id: int | None = None
        self.holder_id: int | None = None
        self.offered_to_us = False
        self.out_of_squad = False
        """The user may no longer see the drone."""
        self.loss_check_asked = False
        """The tower has refused to arm until the loss check is acknowledged."""
        self._drone_id = drone_id
        self._online: bool | None = None
        self._sentences: list[str] = []
        self._said_at: dict[str, float] = {}
        self._unsaid: Counter[str] = Counter()

    @property
    def has_controls(self) -> bool:
        """Whether the user is the holder, as far as the tower has reported."""
        return self.user_id is not None and self.holder_id == self.user_id

    def event(self, text: str, now: float) -> list[dict[str, Any]]:
        """Takes one text message; returns the replies to send at once. Ignores unknown messages."""
        try:
            event = msgspec.json.decode(text)
        except msgspec.DecodeError:
            return []
        if not isinstance(event, dict):
            return []
        try:
            return self._event(event, now)
        except (KeyError, TypeError):
            return []  # a tower of another version must not end a flight

    def _event(self, event: dict[str, Any], now: float) -> list[dict[str, Any]]:
        kind = event.get("type")
        if kind == "ping":
            return [{"type": "pong", "sequence": event["sequence"]}]
        if kind == "welcome":
            self._welcome(event)
        elif kind == "drone" and event["drone"]["id"] == self._drone_id:
            self._drone(event["drone"])
        elif kind is not None and event.get("drone_id") in (None, self._drone_id):
            self._other(kind, event, now)
        return []

    def pop_sentences(self) -> list[str]:
        """Returns the pending sentences, in order."""
        sentences, self._sentences = self._sentences, []
        return sentences

    def say(self, text: str, now: float, count: int = 1) -> None:
        """Adds the sentence, or only counts it if it was added recently."""
        if now - self._said_at.get(text, float("-inf")) < REPEATED_AFTER_S:
            self._unsaid[text] += count
            return
        times = count + self._unsaid.pop(text, 0)
        if len(self._said_at) >= MAX_REMEMBERED:
            self._said_at.clear()
            self._unsaid.clear()
        self._said_at[text] = now
        self._sentences.append(f"{text} ({times} times)" if times > 1 else text)

    def _welcome(self, event: dict[str, Any]) -> None:
        self.user_id = event["user"]["id"]
        ours = [drone for drone in event["drones"] if drone["id"] == self._drone_id]
        if ours:
            self._drone(ours[0])
        else:
            self.out_of_squad = True

    def _drone(self, drone: dict[str, Any]) -> None:
        self.name = drone["name"]
        if drone["online"] != self._online:
            self._online = drone["online"]
            self._sentences.append(f"{self.name} is {'online' if self._online else 'offline'}")
        had = self.has_controls
        self.holder_id = drone["holder"]["id"] if drone["holder"] else None
        taken_from = drone["taken_from"]
        self.offered_to_us = bool(drone["offered"] and taken_from and taken_from["id"] == self.user_id)
        if had != self.has_controls:
            mine = "you have" if self.has_controls else "you do NOT have"
            self._sentences.append(f"{mine} the controls of {self.name}")

    def _other(self, kind: str, event: dict[str, Any], now: float) -> None:
        if kind == "drone_removed":
            self.out_of_squad = True
        elif kind == "control":
            self._control(event)
        elif kind == "hold" and event["step"] in _STEPS:
            self._sentences.append(f"hold {event['step']}: {event['detail']}")
        elif kind == "turn":
            self._sentences.append(f"{event['user']['name']}'s commands pass now")
        elif kind == "notice":
            self.loss_check_asked |= event["code"] == "loss-check"
            self.say(event["text"], now, event["count"])
        elif kind == "lost":
            self.say(f"frames of {self.name} were lost: this end reads too slowly", now, event["count"])

    def _control(self, event: dict[str, Any]) -> None:
        by = event["by"]["name"] if event["by"] else "the tower"
        did = _DID.get(event["event"], f"changed the controls ({event['event']})")
        why = f": {event['reason']}" if event["reason"] else ""
        self._sentences.append(f"{by} {did}{why}")
        if self.offered_to_us and event["event"] == "given":
            self._sentences.append("the controls are offered to you: centre the sticks, type accept and press Enter")
