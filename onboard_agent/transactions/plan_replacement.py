"""Replaces the plan on board, all of it or nothing: reads and keeps the old plan, writes the new one, reads it back.

Trusts only what it reads back. I/O only by the journal; takes `now`.

    LEARNING     reads the plan on board; nothing is written yet
    WRITING      the intent is in the journal; the new plan is being written
    READING      reads back. The new plan: done  /  the old one: untouched  /  else RESTORING
    RESTORING    the old plan is being written
    PROVING      reads back. The old plan: restored  /  else RESTORING again; after MAX_RESTORES it is unknown

Recovery after a crash starts at READING, with both plans from the journal.

Rules, each tested:
- The journal has the intent before the first frame of a write, and until a read-back shows one complete plan.
- A stop (cancel, deadline, new epoch) before the read-back has shown the new plan restores the old one.
- A read-back matches if every field is what the autopilot's table (wire.plan_keeping) predicts for the plan sent.
  An altitude that is off by the autopilot's step matches only if the autopilot acknowledged the plan, because old and
  new plan may differ by exactly that step.
- If it ends with an unknown plan on board, the journal keeps the intent.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

from onboard_agent.transactions.journal import Intent, JournalStore, Lasting, write_intent
from onboard_agent.transactions.plan_download import DownloadFailed, PlanDownload
from onboard_agent.transactions.plan_frames import PlanFrames
from onboard_agent.transactions.plan_words import PLAN_NAMES, item_words, kept_words
from onboard_agent.transactions.plan_write import PlanWrite, WriteFailed, Written
from onboard_agent.transactions.retry_policy import RetryPolicy
from wire.plan_keeping import Change, differences, number_words, same_plan
from wire.plans import Plan
from wire.transactions import Outcome

MAX_READS: Final = 2
MAX_RESTORES: Final = 3


class Phase(StrEnum):
    """The state of a replacement, reported as its progress."""

    LEARNING = "learning"
    WRITING = "writing"
    READING = "reading"
    RESTORING = "restoring"
    PROVING = "proving"


@dataclass(frozen=True, slots=True)
class ReplacementEnd:
    """`on_board`: the plan as the autopilot has it, None if unknown. `is_new`: it is the new plan."""

    outcome: Outcome
    words: str
    on_board: Plan | None
    is_new: bool
    code: str = ""
    item: int | None = None


@dataclass(frozen=True, slots=True)
class _Trouble:
    outcome: Outcome
    why: str
    code: str = ""
    item: int | None = None


class PlanReplacement:
    """Call `due` at each tick and after each `receive`, until `end` is set; `stop` abandons the replacement."""

    def __init__(
        self,
        talk: PlanFrames,
        new: Plan,
        journal: JournalStore,
        patience: RetryPolicy,
        *,
        left_open: Intent | None = None,
    ) -> None:
        """`left_open`: the journal's intent of an earlier write; a rollback restores its old plan."""
        self._talk = talk
        self._new = new
        self._journal = journal
        self._patience = patience
        self._left_open = left_open is not None
        self._disk: tuple[Lasting, Callable[[OSError | None], None]] | None = None
        """The pending journal change, and its continuation."""
        self._old: Plan = () if left_open is None else left_open.old
        self._old_known = left_open is not None
        self._trouble: _Trouble | None = None
        self._recovers = False
        self._written_again = False
        self._accepted = False
        self._reads = 0
        self._restores = 0
        self._part: PlanDownload | PlanWrite = PlanDownload(talk, patience)
        self._out: list[bytes] = []
        self.phase = Phase.LEARNING
        self.end: ReplacementEnd | None = None

    @classmethod
    def recovery(
        cls, talk: PlanFrames, intent: Intent, journal: JournalStore, patience: RetryPolicy
    ) -> "PlanReplacement":
        """After a crash, or after an end with an unknown plan: the plan on board becomes one of the two."""
        made = cls(talk, intent.new, journal, patience, left_open=intent)
        made._recovers = True
        made._trouble = _Trouble(Outcome.FAILED, "the agent was interrupted while it wrote")
        made.phase = Phase.READING
        return made

    @property
    def progress(self) -> tuple[Phase, int, int]:
        """The phase, items done in it, and its items in total."""
        return (self.phase, *self._part.progress)

    @property
    def has_written(self) -> bool:
        """Whether the plan on board may have changed."""
        return self.phase is not Phase.LEARNING

    def receive(self, message: Any, now: float) -> None:
        """Takes a message that the autopilot addressed to the agent."""
        if self.end is None:
            self._part.receive(message, now)

    def due(self, now: float) -> list[bytes]:
        """Frames to send now."""
        out, self._out = self._out, []
        out += self._part.due(now)
        self._check_disk()
        while self.end is None and self._disk is None and self._part.end is not None:
            self._advance()
            out += self._part.due(now)
        return out

    def stop(self, outcome: Outcome, why: str) -> None:
        """Stops the replacement. `why`: part of a sentence."""
        if self.end is not None or (self._trouble is not None and not self._may_still_be_done):
            return
        self._trouble = _Trouble(outcome, why)
        if self.phase is Phase.LEARNING:
            if self._disk is not None:
                self._disk = None
                if not self._left_open:
                    self._remove_intent()
            self._finish(on_board=None, is_new=False, words="Nothing was written; the plan on board is as it was.")
        elif isinstance(self._part, PlanWrite):
            self._out += self._part.stop()
            self._read()

    @property
    def _may_still_be_done(self) -> bool:
        """The write failed (a lost answer, for example), but the read-back may still show the new plan."""
        failed = self._trouble is not None and self._trouble.outcome is Outcome.FAILED
        return failed and self.phase is Phase.READING and not self._recovers

    def _advance(self) -> None:
        match self.phase:
            case Phase.LEARNING:
                self._learnt()
            case Phase.WRITING:
                self._written()
            case Phase.READING:
                self._read_back()
            case Phase.RESTORING:
                self._accepted = isinstance(self._part.end, Written)
                self._begin(Phase.PROVING, self._download_after_write())
            case Phase.PROVING:
                self._proved()

    def _learnt(self) -> None:
        end = self._part.end
        if isinstance(end, DownloadFailed):
            self._trouble = _Trouble(Outcome.FAILED, end.why, end.code)
            self._finish(on_board=None, is_new=False, words="Nothing was written; the plan on board is as it was.")
            return
        on_board = self._plan_read
        if self._new == on_board:
            self._finish(on_board=on_board, is_new=True, words=f"The {self._the} was on board already.")
            return
        if not self._old_known:
            self._old, self._old_known = on_board, True

        def saved(error: OSError | None) -> None:
            if error is None:
                self._begin(Phase.WRITING, PlanWrite(self._talk, self._new, self._patience))
                return
            self._trouble = _Trouble(Outcome.FAILED, f"the agent cannot write its journal ({error.strerror or error})")
            self._finish(on_board=on_board, is_new=False, words="Nothing was written; the plan on board is as it was.")

        try:
            lasting = write_intent(self._journal, self._talk.kind, old=self._old, new=self._new)
        except OSError as error:
            saved(error)
            return
        self._when(lasting, saved)

    def _written(self) -> None:
        end = self._part.end
        self._accepted = isinstance(end, Written)
        if isinstance(end, WriteFailed) and self._trouble is None:
            self._trouble = _Trouble(Outcome.FAILED, end.why, end.code, end.item)
        self._read()

    def _read(self) -> None:
        self._reads += 1
        self._begin(Phase.READING, self._download_after_write())

    def _download_after_write(self) -> PlanDownload:
        return PlanDownload(self._talk, self._patience, wait_s=self._talk.settle_s)

    def _read_back(self) -> None:
        if isinstance(self._part.end, DownloadFailed):
            self._not_read(self._part.end)
            return
        on_board = self._plan_read
        stopped = self._trouble is not None and self._trouble.outcome is not Outcome.FAILED
        if self._was_dropped(on_board):
            self._written_again = True
            self._begin(Phase.WRITING, PlanWrite(self._talk, self._new, self._patience))
        elif self._shows(self._new, on_board) and not stopped:
            self._finish(on_board=on_board, is_new=True, words=self._done_words(on_board))
        elif self._old == on_board:
            self._finish(on_board=on_board, is_new=False, words=f"The old {self._the} is untouched.")
        else:
            if self._trouble is None:
                self._trouble = self._trouble_in(on_board)
            self._restore()

    def _was_dropped(self, on_board: Plan) -> bool:
        """Whether the autopilot accepted the plan and then dropped it (PlanFrames.settle_s). This happens once."""
        dropped = self._accepted and self._talk.settle_s > 0.0 and bool(self._new) and not on_board
        return dropped and self._trouble is None and not self._written_again

    def _not_read(self, end: DownloadFailed) -> None:
        if self._trouble is None or self._recovers:
            self._trouble = _Trouble(Outcome.FAILED, end.why, end.code)
        if self._reads < MAX_READS:
            self._read()
        elif self._recovers:
            self._unknown()  # the autopilot does not answer: a write now would only make things worse
        else:
            self._restore()

    def _shows(self, plan: Plan, on_board: Plan) -> bool:
        """Whether this plan is on board, either as the autopilot keeps it or as it was read before."""
        talk = self._talk
        return plan == on_board or same_plan(talk.keeping, talk.kind, plan, on_board, exactly=not self._accepted)

    def _trouble_in(self, on_board: Plan) -> _Trouble:
        talk = self._talk
        found = differences(talk.keeping, talk.kind, self._new, on_board, exactly=not self._accepted)
        return _trouble_of(found[0])

    def _restore(self) -> None:
        self._restores += 1
        self._begin(Phase.RESTORING, PlanWrite(self._talk, self._old, self._patience))

    def _proved(self) -> None:
        if not isinstance(self._part.end, DownloadFailed):
            on_board = self._plan_read
            if self._shows(self._old, on_board):
                words = f"The old {self._the} was put back." if self._old else f"There is no {self._the} on board now."
                self._finish(on_board=on_board, is_new=False, words=words)
                return
        if self._restores < MAX_RESTORES:
            self._restore()
        else:
            self._unknown()

    def _unknown(self) -> None:
        words = f"The {self._the} on board is unknown: do not fly it."
        self._finish(on_board=None, is_new=False, words=words, proved=False)

    def _finish(self, *, on_board: Plan | None, is_new: bool, words: str, proved: bool = True) -> None:
        trouble = None if is_new else self._trouble
        if trouble is None:
            end = ReplacementEnd(Outcome.DONE, words, on_board, is_new)
        else:
            why = f"{item_words(trouble.item)}{trouble.why}. "
            sentence = why[0].upper() + why[1:] + words
            end = ReplacementEnd(trouble.outcome, sentence, on_board, is_new, trouble.code, trouble.item)

        def over(_error: OSError | None) -> None:
            self.end = end  # an intent that remains is read back once more, which finds one complete plan

        lasting = self._remove_intent() if is_new or (proved and self.has_written) else None
        self._when(lasting, over)

    def _remove_intent(self) -> Lasting | None:
        try:
            return self._journal.remove(self._talk.kind)
        except OSError:
            return None

    def _when(self, lasting: Lasting | None, then: Callable[[OSError | None], None]) -> None:
        """Calls `then` at once, or when the journal change is done."""
        if lasting is None:
            then(None)
        else:
            self._disk = lasting, then

    def _check_disk(self) -> None:
        if self._disk is None:
            return
        lasting, then = self._disk
        error = None
        try:
            if not lasting():
                return
        except OSError as raised:
            error = raised
        self._disk = None
        then(error)

    def _begin(self, phase: Phase, part: PlanDownload | PlanWrite) -> None:
        self.phase, self._part = phase, part

    @property
    def _plan_read(self) -> Plan:
        end = self._part.end
        assert end is not None and not isinstance(end, DownloadFailed | WriteFailed) and hasattr(end, "plan")
        return end.plan

    def _done_words(self, on_board: Plan) -> str:
        done = f"The {self._the} is on board, read back and compared: {len(self._new)} items."
        return done if on_board == self._new else done + kept_words(self._talk.keeping, self._talk.kind, self._new)

    @property
    def _the(self) -> str:
        return PLAN_NAMES[self._talk.kind]


def _trouble_of(change: Change) -> _Trouble:
    if change.field == "count":
        why = f"the autopilot took it, but {change.kept:.0f} items of {change.sent:.0f} are on board"
        return _Trouble(Outcome.FAILED, why)
    has, sent = number_words(change.kept), number_words(change.sent)
    why = f"the autopilot took it, but has {change.field} {has} where {sent} was sent"
    return _Trouble(Outcome.FAILED, why, item=change.item)
