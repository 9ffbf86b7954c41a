"""One command and its answer: sends it, retries it while no answer comes, waits for its result. No I/O; takes `now`.

Rules, each tested:
- Each retry carries the next confirmation number, so that the autopilot can tell it from a second command.
- A take-off, a motor test and similar commands are sent once: if only the acknowledgement is lost, a retry would repeat
  the action.
- IN_PROGRESS ends the retries, and each one extends the deadline, within a bound.
- An autopilot that takes the command in the other message only, or does not know it in this one, gets it in the other
  one, once: nothing was carried out.
- A refusal after an acceptance counts: PX4 answers a mode change twice, first from what receives the message. "Not now"
  is tried again: it refuses a mode with sticks when the first ones have only just arrived.
- After the deadline nothing is sent, and acknowledgements are ignored.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from wire.dialect import mavlink
from wire.transactions import MAX_EXTENDED_S, PROGRESS_EXTENDS_S, Outcome

ANSWER_WITHIN_S: Final = 1.5
TRIES: Final = 4
NOT_NOW_AGAIN_S: Final = 0.5

ONCE: Final = frozenset(
    {
        mavlink.MAV_CMD_NAV_TAKEOFF,
        mavlink.MAV_CMD_NAV_TAKEOFF_LOCAL,
        mavlink.MAV_CMD_NAV_VTOL_TAKEOFF,
        mavlink.MAV_CMD_MISSION_START,
        mavlink.MAV_CMD_DO_MOTOR_TEST,
        mavlink.MAV_CMD_ACTUATOR_TEST,
        mavlink.MAV_CMD_PREFLIGHT_CALIBRATION,
        mavlink.MAV_CMD_DO_START_MAG_CAL,
        mavlink.MAV_CMD_ACCELCAL_VEHICLE_POS,
        mavlink.MAV_CMD_DO_PARACHUTE,
        mavlink.MAV_CMD_DO_FLIGHTTERMINATION,
        mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN,
        mavlink.MAV_CMD_IMAGE_START_CAPTURE,
    }
)
"""Commands that act again on each copy, whatever its confirmation number."""

_NO_REFUSAL: Final = (mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_IN_PROGRESS)
OTHER_MESSAGE: Final = (
    mavlink.MAV_RESULT_UNSUPPORTED,
    mavlink.MAV_RESULT_COMMAND_LONG_ONLY,
    mavlink.MAV_RESULT_COMMAND_INT_ONLY,
)
"""Refusals of the message, not of the command."""
_WORDS: Final = {
    mavlink.MAV_RESULT_ACCEPTED: "{} has accepted it.",
    mavlink.MAV_RESULT_TEMPORARILY_REJECTED: "{} cannot do it now.",
    mavlink.MAV_RESULT_DENIED: "{} denies it: a value is wrong.",
    mavlink.MAV_RESULT_UNSUPPORTED: "{} does not know this command.",
    mavlink.MAV_RESULT_FAILED: "{} tried and failed.",
    mavlink.MAV_RESULT_COMMAND_LONG_ONLY: "{} takes it as COMMAND_LONG only, which cannot say the same.",
    mavlink.MAV_RESULT_COMMAND_INT_ONLY: "{} takes it as COMMAND_INT only, which cannot say the same.",
}


@dataclass(frozen=True, slots=True)
class CommandEnd:
    """`code`: the name of the MAV_RESULT, or empty if there was no answer."""

    outcome: Outcome
    words: str
    code: str = ""


class CommandAnswer:
    """Call `due` at each tick until `end` is set, and `acknowledged` with each COMMAND_ACK addressed to the agent."""

    def __init__(
        self,
        command: int,
        make: Callable[[int], bytes],
        *,
        deadline: float,
        make_other: Callable[[int], bytes] | None = None,
        who: str = "The autopilot",
        tries: int = TRIES,
    ) -> None:
        """`make` builds the frame with the given confirmation, 0..255; `make_other` builds the same command as the
        other message; None: that cannot carry it. `deadline` uses the clock of `now`. `who` is to answer."""
        self._who = who
        self._command = command
        self._make = make
        self._make_other = make_other
        self.deadline = deadline
        """When the answer must have come; IN_PROGRESS extends it."""
        self._latest = deadline + MAX_EXTENDED_S
        self._may_try = self._tries = 1 if command in ONCE else tries
        self._sent = 0
        self._first: tuple[CommandEnd, int, int] | None = None
        """Of the first message: its refusal, how often it was sent, and how many answers to it are still to come."""
        self._again_at = 0.0
        self._in_progress = False
        self.in_progress_count = 0
        self.percent: int | None = None
        """Progress, if the autopilot reports it."""
        self.end: CommandEnd | None = None

    def acknowledged(self, ack: Any, now: float) -> None:
        """Takes a COMMAND_ACK that the autopilot sent to the agent."""
        if ack.command != self._command or not self._sent or now >= self.deadline:
            return
        was_accepted = self.end is not None and self.end.outcome is Outcome.DONE
        if self.end is not None and not (was_accepted and ack.result not in _NO_REFUSAL):
            return
        if was_accepted and ack.result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED and self._sent < self._tries:
            self.end, self._again_at = None, now + NOT_NOW_AGAIN_S
            return
        if ack.result == mavlink.MAV_RESULT_IN_PROGRESS:
            self._in_progress = True
            self.in_progress_count += 1
            self.deadline = min(max(self.deadline, now + PROGRESS_EXTENDS_S), self._latest)
            self.percent = ack.progress if 0 <= ack.progress <= 100 else None
            return
        outcome = Outcome.DONE if ack.result == mavlink.MAV_RESULT_ACCEPTED else Outcome.FAILED
        known = mavlink.enums["MAV_RESULT"].get(ack.result)
        code = str(known.name) if known is not None else f"MAV_RESULT {ack.result}"
        end = CommandEnd(outcome, _WORDS.get(ack.result, f"{{}} answers {code}.").format(self._who), code)
        if ack.result not in OTHER_MESSAGE:
            self.end = end
        elif self._first is None:
            self._first = (end, self._sent, self._sent - 1)
            self._begin_other(now)
        elif self._first[2]:  # a late answer to the first message
            self._first = (*self._first[:2], self._first[2] - 1)
        else:
            self.end = self._first[0]

    def _begin_other(self, now: float) -> None:
        assert self._first is not None
        if self._make_other is None or not self._may_try:
            self.end = self._first[0]
            return
        self._make = self._make_other
        self._tries = self._sent + self._may_try
        self._again_at, self._in_progress = now, False

    def due(self, now: float) -> list[bytes]:
        """Frames to send now."""
        if self.end is not None:
            return []
        if now >= self.deadline:
            self.end = CommandEnd(Outcome.TIMED_OUT, self._silence)
            return []
        if self._in_progress or (self._sent and now < self._again_at) or self._sent >= self._tries:
            return []
        self._sent += 1
        self._again_at = now + ANSWER_WITHIN_S
        return [self._make(self._sent - 1 - (0 if self._first is None else self._first[1]))]

    def nothing_came_of_it(self, now: float) -> None:
        """The autopilot accepted the command but did not carry it out: sends it again while tries are left."""
        if self.end is not None and self._sent < self._tries:
            self.end, self._again_at = None, now

    @property
    def sent(self) -> bool:
        """Whether the command was sent at least once."""
        return self._sent > 0

    def repeat_no_more(self) -> None:
        """Ends the retries, because another copy could undo a later command. An answer still counts."""
        self._tries = max(self._sent, 1)
        self._may_try = 0 if self._sent else self._may_try

    def refused(self, why: str) -> None:
        """The command must not be sent. `why` is a sentence."""
        self.end = CommandEnd(Outcome.REFUSED, why)

    @property
    def _silence(self) -> str:
        if self._in_progress:
            return f"{self._who} started, but did not report the result."
        return f"{self._who} has not answered. It is not known whether it carries out the command."
