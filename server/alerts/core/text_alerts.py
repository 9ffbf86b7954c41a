"""Which texts of an autopilot are alerts, and how long they last. Pure; takes `now`.

A failsafe lasts until the autopilot reports the same one as cleared, or is disarmed. An autopilot whose state tells
whether its failsafe acts (PX4) is believed in that, and not by its texts: it says "Failsafe activated" also where it
only warns, as in a return that a pilot commanded, and says nothing at the end. An error lasts for a while after
its last repetition. Texts of a disarmed autopilot (checks before arming) are for its page, not for everybody.
"""

import re
from dataclasses import dataclass
from typing import Final

from server.alerts.core.rules import AUTOPILOT_ERROR, FAILSAFE, Rule
from server.alerts.core.status_texts import StatusText
from server.link.core.token_bucket import TokenBucket
from wire.dialect import mavlink

ERROR_LASTS_S: Final = 60.0
LASTS_AT_LEAST_S: Final = 10.0
RULES: Final = frozenset({FAILSAFE.name, AUTOPILOT_ERROR.name})
MAX_LASTING: Final = 6
"""Of one drone. Beyond it the oldest ends."""
MAX_WORDS: Final = 200
BURST: Final = 12
"""Texts about something new that become alerts one after the other; then one in EVERY_S."""
EVERY_S: Final = 15.0
MANY: Final = "many"
"""The subject of the one alert for all others."""
_WARNING: Final = int(mavlink.MAV_SEVERITY_WARNING)
_ERROR: Final = int(mavlink.MAV_SEVERITY_ERROR)
_FAILSAFE: Final = re.compile(
    r"fail-?\s?safe|emergency|crash|thrust loss|parachute|ekf variance|control signal lost|attitude failure|"
    r"motor failure|flight termination|geofence (violation|breach)",
    re.IGNORECASE,
)
_OF_STATE: Final = re.compile(r"^failsafe (activated|warning)", re.IGNORECASE)
_OF_STATE_KEY: Final = "@"
"""Begins the subject of what a state tells; no text has it."""
_OVER: Final = re.compile(r"\b(clear(ed)?|recovered|regained|resolved|restored|off|ended)\b", re.IGNORECASE)
_BEFORE_ARMING: Final = re.compile(r"^\s*(pre-?arm|arm)\s*:", re.IGNORECASE)


@dataclass
class _Lasting:
    words: str
    began_at: float
    until: float | None
    """None: until it is cleared."""


class TextAlerts:
    """For one drone."""

    def __init__(self) -> None:
        self._lasting: dict[tuple[str, str], _Lasting] = {}
        self._room = TokenBucket(1 / EVERY_S, BURST, 0.0)

    @property
    def idle(self) -> bool:
        """Nothing lasts."""
        return not self._lasting

    def restore(self, key: tuple[str, str], words: str, now: float) -> None:
        """It lasted when the tower was stopped."""
        until = None if key[0] == FAILSAFE.name else now + ERROR_LASTS_S
        self._lasting[key] = _Lasting(words, now, until)

    def acts(self, name: str, failsafe_words: str, cause: str, now: float) -> None:
        """What the state of an autopilot tells of its failsafe; empty: it does not act. `cause`: tells one from the
        next."""
        key = (FAILSAFE.name, _OF_STATE_KEY + cause)
        words = f"The autopilot of {name}: {failsafe_words}."
        for other in [
            one for one in self._lasting if one[1].startswith(_OF_STATE_KEY) and (one != key or not failsafe_words)
        ]:
            del self._lasting[other]
        if failsafe_words and (key not in self._lasting or self._lasting[key].words != words):
            self._lasting[key] = _Lasting(words, now, None)

    def take(self, name: str, text: StatusText, now: float, *, shows_failsafe: bool = False) -> None:
        """Takes one text of the armed autopilot of the drone of this name. `shows_failsafe`: see `acts`."""
        words = text.text[:MAX_WORDS]
        if _BEFORE_ARMING.match(words) or (shows_failsafe and _OF_STATE.match(words)):
            return
        is_failsafe = _FAILSAFE.search(words) is not None
        if is_failsafe and _OVER.search(words):
            self._lasting.pop((FAILSAFE.name, _subject(words)), None)
        elif is_failsafe and text.severity <= _WARNING:
            self._begin(FAILSAFE, name, words, now, until=None)
        elif text.severity <= _ERROR:
            self._begin(AUTOPILOT_ERROR, name, words, now, until=now + ERROR_LASTS_S)

    def disarmed(self, now: float) -> None:
        """Everything is over, but people are told of a crash although it disarms the autopilot at once."""
        for one in self._lasting.values():
            over_at = max(now, one.began_at + LASTS_AT_LEAST_S)
            one.until = over_at if one.until is None else min(one.until, over_at)

    def found(self, now: float) -> dict[tuple[str, str], str]:
        """Returns the words of what lasts, by rule and subject."""
        for key in [key for key, one in self._lasting.items() if one.until is not None and now >= one.until]:
            del self._lasting[key]
        return {key: one.words for key, one in self._lasting.items()}

    def _begin(self, rule: Rule, name: str, words: str, now: float, *, until: float | None) -> None:
        key = (rule.name, _subject(words))
        told = f"The autopilot of {name} says: {words}"
        if key not in self._lasting and not self._room.take(1, now):
            # A flood would push out of everybody's channels what others need to know.
            key, until = (rule.name, MANY), now + ERROR_LASTS_S
            told = f"The autopilot of {name} reports more than can be told one by one: read its messages."
        self._lasting.pop(key, None)
        if len(self._lasting) >= MAX_LASTING:
            del self._lasting[next(iter(self._lasting))]
        self._lasting[key] = _Lasting(told, now, until)


def is_of_text(rule_name: str, subject: str) -> bool:
    """Whether a text opened this alert: the vehicle's own claim, and not what its state shows."""
    return rule_name in RULES and not subject.startswith(_OF_STATE_KEY)


def _subject(words: str) -> str:
    """Two texts about the same thing have the same subject: its first words, without figures."""
    kept = re.split(r"\s[-–]\s|:", words, maxsplit=1)[0].lower()
    kept = re.sub(r"\b(cleared?|recovered|regained|resolved|restored|off|ended|on|activated)\b|[^a-z ]", "", kept)
    return " ".join(kept.split())[:40]
