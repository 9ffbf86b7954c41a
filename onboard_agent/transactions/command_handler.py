"""Handler for commands: sends each by the path of the holder's frames and reports its answer in words. No I/O.

Rules, each tested:
- A command that may not pass as a frame of the holder does not pass here either.
- A mode change is done when a heartbeat shows the mode. Until then it is only accepted.
- If no answer comes in time, a mode that a heartbeat after the command shows is reached, and so is being armed or
  disarmed. A mode that the autopilot's own failsafe has chosen proves nothing.
- IN_PROGRESS is reported, at least once a second, so that the tower waits too.
- For speed, home, the current mission item, mission start, and on PX4 a target and a circle, the result says whether
  telemetry showed the effect within SEEN_WITHIN_S of the acceptance. A refusal that comes instead is the answer.
- A later command, a frame with a command, or a hold ends the retries of earlier commands, so that no copy of an old
  command undoes a new one. A new epoch ends both the retries and the waiting.
- A refusal includes the autopilot's own text, if one arrives within WORDS_WITHIN_S of its answer.
- Several commands may wait at once, each under its own component id, so that answers cannot be confused. If no id is
  free, the oldest command ends.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from onboard_agent.autopilot.flight_modes import commanded_mode
from onboard_agent.autopilot.mode_names import mission_modes, mode_name
from onboard_agent.autopilot.own_frames import FrameMaker, Sender, request_message
from onboard_agent.transactions.command_answer import ANSWER_WITHIN_S, CommandAnswer, CommandEnd
from onboard_agent.transactions.command_seen import READ, SEEN_WITHIN_S, Seen, Without, what_shows
from onboard_agent.transactions.handler import Around
from onboard_agent.transactions.status_texts import StatusTexts
from wire.autopilots.command_messages import AUTOPILOT, makers
from wire.autopilots.registry import FAMILIES, multicopter
from wire.dialect import decode, mavlink
from wire.frames import message_id, source
from wire.plans import as_float32
from wire.transactions import (
    CommandWork,
    Outcome,
    Transaction,
    TransactionProgress,
    TransactionResult,
    TransactionToTower,
)

COMPONENTS: Final = (
    mavlink.MAV_COMP_ID_ONBOARD_COMPUTER2,
    mavlink.MAV_COMP_ID_ONBOARD_COMPUTER3,
    mavlink.MAV_COMP_ID_ONBOARD_COMPUTER4,
)
"""Component ids for commands. The agent's own id is for its own actions: holds and requests."""

MODE_AGAIN_S: Final = 0.5
"""A mode that was accepted this long ago and is still not shown is requested again."""
SHOW_EVERY_S: Final = 0.25
WORDS_WITHIN_S: Final = 0.3
WORDS_BEFORE_S: Final = 0.3
PROGRESS_EVERY_S: Final = 0.2
PROGRESS_AT_LEAST_EVERY_S: Final = 1.0

_log = logging.getLogger(__name__)
_CUSTOM: Final = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
_MODE: Final = mavlink.MAV_CMD_DO_SET_MODE
_ARM: Final = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
_ARMED: Final = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
_SHOWS_ARMED: Final = {
    True: "The autopilot shows that it is armed. Its answer was lost.",
    False: "The autopilot shows that it is disarmed. Its answer was lost.",
}

Send = Callable[[bytes, float], str | None]
"""Checks a holder's frame that is about to go to the autopilot: None if it may pass, else a sentence why not."""


@dataclass(slots=True)
class _Waiting:
    transaction: Transaction
    work: CommandWork
    component: int
    answer: CommandAnswer
    mode: frozenset[int]
    """A heartbeat must show one of these custom_modes; empty if the command changes no mode."""
    wanted: Seen | None = None
    """The effect that telemetry should show."""
    commanded: int = 0
    """The value of Around.commanded when the command was last sent."""
    mode_before: int = 0
    """The custom_mode shown at that time."""
    ended_at: float | None = None
    """When the answer arrived."""
    shown: bool = False
    sent_at: float | None = None
    """When it was sent first."""
    proof: str = ""
    """What the newest heartbeat since then shows, if it is what the command asked for."""
    show_again_at: float = 0.0
    reported_percent: int | None = None
    reported_count: int = 0
    reported_at: float = float("-inf")


class CommandHandler:
    """A TransactionHandler. `send` checks outgoing frames. `commanded` returns the current Around.commanded."""

    works = (CommandWork,)
    hears = frozenset(
        READ | {mavlink.MAVLINK_MSG_ID_COMMAND_ACK, mavlink.MAVLINK_MSG_ID_HEARTBEAT, mavlink.MAVLINK_MSG_ID_STATUSTEXT}
    )

    def __init__(self, maker: FrameMaker, *, send: Send, commanded: Callable[[], int]) -> None:
        self._maker = maker
        self._send = send
        self._commanded = commanded
        self._system: int | None = None
        self._kind = 0
        self._waiting: list[_Waiting] = []
        self._spoken = StatusTexts()
        self._reports: list[TransactionToTower] = []

    def autopilot_came(self, around: Around, now: float) -> None:
        """The autopilot may have rebooted: ends the retries of earlier commands."""
        self._repeat_no_more()

    def begin(self, transaction: Transaction, around: Around | None, now: float) -> None:
        """Starts a command from the tower."""
        work = transaction.work
        assert isinstance(work, CommandWork)
        if around is None or not around.heard:
            self._report(transaction.id, Outcome.REFUSED, "No heartbeat from the autopilot.")
            return
        self._system, self._kind = around.system_id, around.autopilot_kind
        if not _fits(work):
            self._report(transaction.id, Outcome.REFUSED, "A value of the command is too large to be sent.")
            return
        self._repeat_no_more()
        if len(self._waiting) >= len(COMPONENTS):
            oldest = self._waiting.pop(0)
            self._report(
                oldest.transaction.id,
                Outcome.CANCELLED,
                "Later commands replaced it. It is not known whether the autopilot carries it out.",
            )
        used = {waiting.component for waiting in self._waiting}
        component = next(one for one in COMPONENTS if one not in used)
        sender = Sender(around.system_id, component)
        deadline = now + transaction.deadline_s

        make, make_other = makers(
            work, around.system_id, around.autopilot_kind, lambda message: self._maker.make(message, sender)
        )
        answer = CommandAnswer(
            work.command,
            make,
            make_other=make_other,
            deadline=deadline,
            who="The autopilot" if work.component == AUTOPILOT else "The camera",
        )
        modes = _modes_asked(work, around)
        self._waiting.append(_Waiting(transaction, work, component, answer, modes, what_shows(work, around)))

    def cancel(self, transaction_id: int, now: float) -> None:
        """Ends the retries and stops waiting for the answer."""
        for waiting in self._waiting:
            if waiting.transaction.id == transaction_id:
                self._give_up(waiting, Outcome.CANCELLED, "It was cancelled")
                return

    def epoch_changed(self, epoch: int, now: float) -> None:
        """Ends the commands of the previous holder."""
        for waiting in list(self._waiting):
            if waiting.transaction.epoch != epoch:
                self._give_up(waiting, Outcome.STALE_EPOCH, "The controls changed hands meanwhile")

    def receive(self, frame: bytes, now: float) -> bool:
        """Takes a frame of a type in `hears`."""
        system, component = source(frame)
        if not self._waiting or system != self._system:
            return False
        if component != AUTOPILOT and message_id(frame) != mavlink.MAVLINK_MSG_ID_COMMAND_ACK:
            return False
        message = decode(frame)
        if message is None:
            return False
        if message_id(frame) == mavlink.MAVLINK_MSG_ID_STATUSTEXT:
            self._spoken.receive(message, now)
            return False
        if message_id(frame) == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            for waiting in self._waiting:
                waiting.shown = waiting.shown or (waiting.answer.sent and message.custom_mode in waiting.mode)
                waiting.proof = self._proof(waiting, message)
        if message_id(frame) != mavlink.MAVLINK_MSG_ID_COMMAND_ACK:
            for waiting in self._waiting:
                if waiting.wanted is not None and waiting.answer.end is not None:
                    waiting.wanted.receive(message_id(frame), message)
            return False
        return self._acknowledged(message, component, now)

    def due(self, around: Around, now: float) -> list[bytes]:
        """Frames to send to the autopilot now."""
        out: list[bytes] = []
        for waiting in list(self._waiting):
            if waiting.answer.sent and waiting.commanded != self._commanded():
                waiting.answer.repeat_no_more()
            if self._is_proved(waiting, around, now):
                continue
            for frame in waiting.answer.due(now):
                why_not = self._send(frame, now)
                if why_not is None:
                    out.append(frame)
                    _trace(waiting, "goes to the autopilot")
                    waiting.sent_at = now if waiting.sent_at is None else waiting.sent_at
                    # A heartbeat from before this command proves nothing.
                    waiting.shown, waiting.mode_before, waiting.ended_at = False, around.custom_mode, None
                else:
                    waiting.answer.refused(why_not)
                waiting.commanded = self._commanded()
            out += self._settle(waiting, around, now)
        return out

    def reports(self) -> list[TransactionToTower]:
        """Returns the messages for the tower once, in order."""
        reports, self._reports = self._reports, []
        return reports

    def resend(self) -> None:
        """Does nothing: commands have no state to report."""

    # Internals.

    def _acknowledged(self, ack: Any, component: int, now: float) -> bool:
        """Returns whether the acknowledgement is addressed to one of our component ids alone."""
        ours = ack.target_system == self._system and ack.target_component in COMPONENTS
        for waiting in self._waiting:
            names_nobody = ack.target_component == 0 or ack.target_system == 0
            if component != waiting.work.component:
                continue
            if waiting.component == ack.target_component or names_nobody:
                waiting.answer.acknowledged(ack, now)
                if ack.command == waiting.work.command:
                    _trace(waiting, f"is acknowledged by the autopilot with MAV_RESULT {ack.result}")
        return ours

    def _proof(self, waiting: _Waiting, beat: Any) -> str:
        """Returns a sentence for a heartbeat that shows what the command asked for."""
        if not waiting.answer.sent:
            return ""
        if waiting.work.command == _ARM and waiting.work.component == AUTOPILOT:
            wants = (waiting.work.params[0] or 0.0) >= 0.5
            return _SHOWS_ARMED[wants] if bool(beat.base_mode & _ARMED) == wants else ""
        family = FAMILIES.get(self._kind)
        by_failsafe = family is not None and family.shows_failsafe and beat.system_status == mavlink.MAV_STATE_CRITICAL
        if beat.custom_mode not in waiting.mode or by_failsafe:
            return ""
        mode = mode_name(self._kind, beat.type, beat.custom_mode)
        return f"The autopilot shows {mode}. Its answer was lost."

    def _is_proved(self, waiting: _Waiting, around: Around, now: float) -> bool:
        """Ends a command whose answer is lost, but whose effect is seen."""
        late = waiting.sent_at is not None and now >= waiting.sent_at + ANSWER_WITHIN_S
        if waiting.answer.end is not None or not waiting.proof or not late:
            return False
        self._end(waiting, CommandEnd(Outcome.DONE, waiting.proof), around, seen=True)
        return True

    def _settle(self, waiting: _Waiting, around: Around, now: float) -> list[bytes]:
        end = waiting.answer.end
        if end is None:
            self._report_progress(waiting, now)
            return []
        if end.outcome is Outcome.FAILED:
            return self._refused(waiting, end, around, now)
        if end.outcome is Outcome.DONE and waiting.wanted is not None:
            return self._check(waiting, waiting.wanted, end, around, now)
        if end.outcome is not Outcome.DONE or not waiting.mode:
            self._end(waiting, end, around)
            return []
        mode = mode_name(around.autopilot_kind, around.vehicle_type, max(waiting.mode))
        if waiting.shown:
            words = f"The autopilot shows {mode}."
            self._end(waiting, CommandEnd(Outcome.DONE, words, end.code), around, seen=True)
        elif waiting.commanded != self._commanded():
            words = f"The autopilot accepted {mode}, then got another command before it showed the mode."
            self._end(waiting, CommandEnd(Outcome.FAILED, words, end.code), around)
        elif now >= waiting.answer.deadline:
            words = f"The autopilot accepted {mode}, but its heartbeat does not show it."
            self._end(waiting, CommandEnd(Outcome.TIMED_OUT, words, end.code), around)
        elif self._has_come_to_nothing(waiting, around, now):
            waiting.answer.nothing_came_of_it(now)
        elif now >= waiting.show_again_at:
            waiting.show_again_at = now + SHOW_EVERY_S
            ask = request_message(around.system_id, mavlink.MAVLINK_MSG_ID_HEARTBEAT, confirmation=0)
            return [self._maker.make(ask, Sender(around.system_id, waiting.component))]
        return []

    @staticmethod
    def _has_come_to_nothing(waiting: _Waiting, around: Around, now: float) -> bool:
        """PX4 may accept a stick mode without entering it if the first sticks have only just arrived; a second request
        works. A mode that differs from the one before is someone else's choice, perhaps a pilot's switch: leave it."""
        if waiting.ended_at is None:
            waiting.ended_at = now
        may_be_unentered = multicopter(around.autopilot_kind).family.accepts_modes_it_does_not_enter
        late = now >= waiting.ended_at + MODE_AGAIN_S
        return may_be_unentered and late and around.custom_mode == waiting.mode_before

    def _check(self, waiting: _Waiting, wanted: Seen, end: CommandEnd, around: Around, now: float) -> list[bytes]:
        if waiting.ended_at is None:
            waiting.ended_at = now
        late = now >= min(waiting.answer.deadline, waiting.ended_at + SEEN_WITHIN_S)
        shown = wanted.shown
        if shown is not None or late or waiting.commanded != self._commanded():
            there = f": {wanted.words}" if wanted.words else ""
            replaced = waiting.commanded != self._commanded()
            texts = self._spoken.since(waiting.ended_at) if not shown and not replaced else []
            if texts and wanted.without_it is not Without.UNCONFIRMED:
                words = f"The autopilot refuses: {'; '.join(texts)}."
                self._end(waiting, CommandEnd(Outcome.FAILED, words, end.code), around, seen=False)
                return []
            if not shown and not replaced and wanted.without_it is Without.FAILED:
                words = f"The autopilot accepted it, and does not do it{there}."
                self._end(waiting, CommandEnd(Outcome.FAILED, words, end.code), around, seen=False)
                return []
            words = f"Seen{there}." if shown else f"Accepted, not confirmed yet{there}."
            self._end(waiting, CommandEnd(Outcome.DONE, words, end.code), around, seen=bool(shown))
        elif wanted.asks is not None and now >= waiting.show_again_at:
            waiting.show_again_at = now + SHOW_EVERY_S
            ask = request_message(around.system_id, wanted.asks, confirmation=0)
            return [self._maker.make(ask, Sender(around.system_id, waiting.component))]
        return []

    def _refused(self, waiting: _Waiting, end: CommandEnd, around: Around, now: float) -> list[bytes]:
        if waiting.ended_at is None:
            waiting.ended_at = now
        if now - waiting.ended_at >= WORDS_WITHIN_S:
            texts = self._spoken.since(waiting.ended_at - WORDS_BEFORE_S)
            says = bool(texts) and waiting.work.component == AUTOPILOT
            words = f"The autopilot refuses: {'; '.join(texts)}." if says else end.words
            self._end(waiting, CommandEnd(end.outcome, words, end.code), around)
        return []

    def _end(self, waiting: _Waiting, end: CommandEnd, around: Around, *, seen: bool | None = None) -> None:
        self._waiting.remove(waiting)
        self._report(waiting.transaction.id, end.outcome, f"{end.words} {state_words(around)}", end.code, seen)

    def _give_up(self, waiting: _Waiting, outcome: Outcome, why: str) -> None:
        self._waiting.remove(waiting)
        known = "it is not known whether the autopilot carries it out" if waiting.answer.sent else "it was not sent"
        self._report(waiting.transaction.id, outcome, f"{why}; {known}.")

    def _repeat_no_more(self) -> None:
        for waiting in self._waiting:
            waiting.answer.repeat_no_more()

    def _report_progress(self, waiting: _Waiting, now: float) -> None:
        answer = waiting.answer
        every_s = PROGRESS_AT_LEAST_EVERY_S if answer.percent == waiting.reported_percent else PROGRESS_EVERY_S
        if answer.in_progress_count == waiting.reported_count or now - waiting.reported_at < every_s:
            return
        waiting.reported_percent, waiting.reported_at = answer.percent, now
        waiting.reported_count = answer.in_progress_count
        done, total = (0, 0) if answer.percent is None else (answer.percent, 100)
        progress = TransactionProgress(id=waiting.transaction.id, phase="carrying out", done=done, total=total)
        self._reports.append(progress)

    def _report(
        self, transaction_id: int, outcome: Outcome, words: str, code: str = "", seen: bool | None = None
    ) -> None:
        self._reports.append(
            TransactionResult(id=transaction_id, outcome=outcome, words=words[:600], code=code, seen=seen)
        )


def _trace(waiting: _Waiting, words: str) -> None:
    if waiting.transaction.trace:
        _log.info("request %s: MAV_CMD %d %s", waiting.transaction.trace, waiting.work.command, words)


def state_words(around: Around) -> str:
    """Describes the state of the drone in one sentence."""
    mode = mode_name(around.autopilot_kind, around.vehicle_type, around.custom_mode)
    armed = "armed" if around.armed else "disarmed"
    where = "in the air" if around.airborne else "on the ground"
    if not around.heard:
        return f"No heartbeat from the autopilot. At the last one it was {armed}, {where}, in {mode}."
    return f"The drone is {armed}, {where}, in {mode}."


def _fits(work: CommandWork) -> bool:
    try:
        for value in work.params:
            as_float32(value or 0.0)
    except ValueError:
        return False
    return True


def _modes_asked(work: CommandWork, around: Around) -> frozenset[int]:
    flags, main, sub = (value or 0.0 for value in work.params[:3])
    if work.command != _MODE or not int(flags) & _CUSTOM:
        return frozenset()
    mode = commanded_mode(around.autopilot_kind, main, sub)
    missions = mission_modes(around.autopilot_kind, around.vehicle_type)
    # Only an autopilot with sub modes may show its mission under a different number than requested.
    has_sub_modes = commanded_mode(around.autopilot_kind, 0, 1) != 0
    return missions if has_sub_modes and mode in missions else frozenset({mode})
