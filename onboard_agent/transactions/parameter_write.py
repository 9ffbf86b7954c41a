"""Writes parameters one after another, and trusts only what it reads back. No I/O; takes `now`.

Rules, each tested:
- Parameters are written in the given order; each is read back or given up before the next is sent.
- An invalid value is refused without being sent: not a number, a fraction for an integer, out of range for its kind.
- A parameter that is not in the table is requested by name first: its kind decides how its value is encoded.
- The final value of each parameter that differs from the requested one is reported, in words.
- After a write of its system id the autopilot may answer under the new one, which the agent has to find first.
- A stopped write finishes its current parameter and begins no other. After two unanswered ones it stops by itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

from onboard_agent.transactions.handler import Around
from onboard_agent.transactions.parameter_encoding import HASH_NAME, NAME, ParamValue, as_kept, why_not, words_of
from onboard_agent.transactions.parameter_frames import Pace, ParameterFrames
from onboard_agent.transactions.retry_policy import Repeated
from onboard_agent.transactions.system_id_change import FOLLOWED_WITHIN_S, SYSTEM_IDS
from onboard_agent.transactions.system_id_change import why_not as why_not_system_id
from onboard_agent.transactions.system_id_change import words_of as words_of_system_id
from wire.dialect import mavlink
from wire.parameters import Parameter
from wire.transactions import MAX_REFUSALS, Outcome, ParameterRefusal

MAX_SETS: Final = 2
"""A value already on its way from a list may be older than the one that was set."""
MAX_SILENT: Final = 2
MAX_NAMES_LISTED: Final = 5

_NOT_ANSWERED: Final = "The autopilot has not answered. It is not known whether it has the new value."

_ERRORS: Final = {
    mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST: "The autopilot has no parameter of this name.",
    mavlink.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE: "The autopilot reports that the value is out of range.",
    mavlink.MAV_PARAM_ERROR_PERMISSION_DENIED: "The autopilot does not permit it.",
    mavlink.MAV_PARAM_ERROR_COMPONENT_NOT_FOUND: "The autopilot does not know the component.",
    mavlink.MAV_PARAM_ERROR_READ_ONLY: "It can be read only.",
}


class _At(StrEnum):
    LEARNING = "learning"
    SETTING = "setting"
    CHECKING = "checking"
    MOVING = "moving"
    """Its system id was written, and it does not answer under the old one."""


@dataclass(frozen=True, slots=True)
class WriteEnd:
    """`refusals`: the first MAX_REFUSALS of `refused` refusals."""

    outcome: Outcome
    words: str
    refusals: tuple[ParameterRefusal, ...] = ()
    refused: int = 0


class ParameterWrite:
    """Call `due` at each tick and after each `receive`, until `end` is set."""

    def __init__(
        self,
        talk: ParameterFrames,
        values: Sequence[tuple[str, float]],
        known: Mapping[str, Parameter],
        pace: Pace,
        around: Around,
    ) -> None:
        """`known`: the known part of the table. `around`: at the beginning."""
        self._talk = talk
        self._values = values
        self._known = known
        self._pace = pace
        self._around = around
        self._moved_by: float | None = None
        """Until when an autopilot with the new system id is waited for."""
        self._has_moved = False
        self._notes = ""
        self._next = 0
        self._at: _At | None = None
        """State of the current parameter; None between two parameters."""
        self._question = Repeated(pace.tries)
        self._kind = 0
        self._sets = 0
        self._before: float | None = None
        self._has: float | None = None
        self._silent = 0
        self._refusals: list[ParameterRefusal] = []
        self._written = 0
        self._stopped: tuple[Outcome, str] | None = None
        self.end: WriteEnd | None = None

    @property
    def progress(self) -> tuple[int, int]:
        """Parameters finished, and in total."""
        return self._next - (self._at is not None), len(self._values)

    def stop(self, outcome: Outcome, why: str, *, at_once: bool = False) -> None:
        """`why`: without a full stop. `at_once`: does not wait for the autopilot's answer to the current parameter."""
        if self._stopped is None:
            self._stopped = outcome, why
        if at_once and self._at is not None:
            self._has = None
            self._refuse(_NOT_ANSWERED)

    def receive(self, received: ParamValue, now: float) -> None:
        """Takes a PARAM_VALUE of the autopilot."""
        if self._at is None or received.name != self._name or self.end is not None:
            return
        self._silent = 0
        self._has = None if received.parameter is None else received.parameter.value
        if self._at is _At.LEARNING:
            self._kind = received.kind
            self._set_if_possible()
        elif self._at is _At.SETTING:
            self._ask(_At.CHECKING, self._talk.ask_name(self._name))
        elif self._has == self._wanted:
            self._written += 1
            self._at = None
            self._note_system_id()
        elif self._sets < MAX_SETS:
            self._set()
        else:
            self._refuse(self._difference)

    def refused(self, message: Any) -> None:
        """Takes a PARAM_ERROR of the autopilot."""
        if self._at is not None and message.param_id == self._name and self.end is None:
            self._silent = 0
            self._refuse(_ERRORS.get(message.error, f"The autopilot answers with error {message.error}."))

    def due(self, now: float) -> list[bytes]:
        """Frames to send now."""
        while self.end is None:
            if self._at is None:
                self._begin_next()
                continue
            question = self._question.due(now)
            if question is not None:
                return [question]
            if self._at is _At.MOVING:
                if now < (self._moved_by or 0.0):
                    break
                self._silent += 1
                self._has = None
                self._refuse(_NOT_ANSWERED)
            elif not self._question.given_up(now):
                break
            elif self._changes_system_id and self._at is not _At.LEARNING:
                self._at, self._moved_by = _At.MOVING, now + FOLLOWED_WITHIN_S
            else:
                self._give_up()
        return []

    def moves_to(self, system_id: int) -> bool:
        """Whether an autopilot with this system id is the one that is written to."""
        return self._at is not None and self._changes_system_id and self._wanted == system_id

    def moved(self, talk: ParameterFrames) -> None:
        """The autopilot has its new system id, as `moves_to` said: the value is read back from there."""
        self._talk = talk
        self._has_moved = True
        self._ask(_At.CHECKING, talk.ask_name(self._name))

    # Internals.

    @property
    def _name(self) -> str:
        return self._values[self._next - 1][0]

    @property
    def _asked(self) -> float:
        return self._values[self._next - 1][1]

    @property
    def _wanted(self) -> float:
        return as_kept(self._asked, self._kind)

    def _begin_next(self) -> None:
        if self._stopped is not None or self._silent >= MAX_SILENT or self._next == len(self._values):
            self._finish()
            return
        self._next += 1
        self._sets = 0
        known = self._known.get(self._name)
        self._before = self._has = None if known is None else known.value
        if not NAME.fullmatch(self._name) or self._name == HASH_NAME:
            self._refuse("No parameter can have this name.")
        elif known is None:
            self._ask(_At.LEARNING, self._talk.ask_name(self._name))
        else:
            self._kind = known.kind
            self._set_if_possible()

    @property
    def _changes_system_id(self) -> bool:
        return self._name in SYSTEM_IDS and self._wanted != self._before

    def _note_system_id(self) -> None:
        if self._changes_system_id:
            self._notes += words_of_system_id(self._wanted, moved=self._has_moved)

    def _set_if_possible(self) -> None:
        self._before = self._has
        trouble = why_not(self._asked, self._kind, self._talk.encoding)
        if trouble is None and self._changes_system_id:
            trouble = why_not_system_id(self._wanted, self._around)
        if trouble is not None:
            self._refuse(trouble)
        else:
            self._set()

    def _set(self) -> None:
        self._sets += 1
        self._ask(_At.SETTING, self._talk.set(self._name, self._asked, self._kind))

    def _ask(self, at: _At, question: bytes) -> None:
        self._at = at
        self._question = Repeated(self._pace.name_tries if at is _At.LEARNING else self._pace.tries)
        self._question.ask(question, self._pace.answer_s)

    def _give_up(self) -> None:
        if self._at is _At.LEARNING:
            self._refuse("The autopilot knows no parameter of this name, or does not answer.")
            return
        self._silent += 1
        if self._at is _At.CHECKING:
            self._refuse("It was accepted but could not be read back.")
        else:
            self._has = None
            self._refuse(_NOT_ANSWERED)

    @property
    def _difference(self) -> str:
        if self._has is None:
            return "The autopilot reports no number for it."
        if self._has == self._before:
            return f"The autopilot keeps {words_of(self._has)}."
        return f"The autopilot changed it to {words_of(self._has)}."

    def _refuse(self, words: str) -> None:
        self._at = None
        self._refusals.append(ParameterRefusal(self._name[:16], self._asked, self._has, words))

    def _finish(self) -> None:
        written, refused, total = self._written, len(self._refusals), len(self._values)
        left = self._values[self._next :]
        if self._stopped is not None:
            outcome, why = self._stopped
            words = f"{why[0].upper()}{why[1:]}: "
        elif left:
            outcome, words = Outcome.FAILED, "The autopilot does not answer any more: "
        else:
            outcome, words = (Outcome.FAILED, "") if refused else (Outcome.DONE, "")
        words += f"{written} of {total} parameters {'is' if written == 1 else 'are'} written and read back"
        if refused:
            names = [refusal.name for refusal in self._refusals[:MAX_NAMES_LISTED]]
            more = f" and {refused - MAX_NAMES_LISTED} more" if refused > MAX_NAMES_LISTED else ""
            words += f", not {', '.join(names)}{more}"
        if left:
            words += f"; {len(left)} {'was' if len(left) == 1 else 'were'} not sent"
        for name, asked in left:
            known = self._known.get(name)
            has = None if known is None else known.value
            self._refusals.append(ParameterRefusal(name[:16], asked, has, "Not sent."))
        received = tuple(self._refusals[:MAX_REFUSALS])
        words = words[0].upper() + words[1:]
        self.end = WriteEnd(outcome, f"{words}.{self._notes}", received, len(self._refusals))
