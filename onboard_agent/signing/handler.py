"""Handler for the signing key: makes it, gives it to the autopilot, and takes it away again. No I/O.

Rules, each tested:
- Only on the ground and disarmed. A key that no longer fits is forgotten at any time: nothing is heard with it.
- A key is kept before it is sent. It counts when the autopilot signs with it (SignedLine).
- Done means that the autopilot has answered a signed question.
"""

import secrets
from collections.abc import Callable
from typing import Any, Final, Protocol

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, setup_signing, timesync_request
from onboard_agent.signing.signed_line import UNSIGNED, Keys, SignedLine
from onboard_agent.transactions.handler import Around
from onboard_agent.transactions.transaction_run import TransactionRun
from wire.dialect import decode, mavlink
from wire.frame_signing import KEY_BYTES
from wire.signing_key import Signing, SigningChange, SigningWork
from wire.transactions import Outcome, Transaction, TransactionToTower

SEND_EVERY_S: Final = 1.0
TRIES: Final = 5
ASK_EVERY_S: Final = 0.5
ANSWERED_WITHIN_S: Final = 5.0

_ON_THE_GROUND: Final = "The signing key is changed on the ground only, when the drone is disarmed."
_NOT_TAKEN: Final = (
    "The autopilot did not take the key: its firmware does not sign, or it already signs with a key that this agent "
    "does not have."
)
_NOT_REMOVED: Final = "The autopilot goes on signing. The agent keeps the key."


class KeyStore(Protocol):
    def keep(self, keys: Keys) -> Callable[[], bool]:
        """Begins to write. What it returns says whether that is done, and raises OSError."""


class SigningHandler:
    """A TransactionHandler. `store` None: there is no disk. `unix_s`: the time of day."""

    works = (SigningWork,)
    hears = frozenset({mavlink.MAVLINK_MSG_ID_TIMESYNC})

    def __init__(
        self,
        maker: FrameMaker,
        line: SignedLine,
        store: KeyStore | None,
        *,
        unix_s: Callable[[], float],
        make_key: Callable[[], bytes] = lambda: secrets.token_bytes(KEY_BYTES),
    ) -> None:
        self._maker = maker
        self._line = line
        self._store = store
        self._unix_s = unix_s
        self._make_key = make_key
        self._kept = line.keys
        self._writing: Callable[[], bool] | None = None
        self._run: TransactionRun | None = None
        self._asked: Any = None
        """SETUP_SIGNING, while the autopilot has not taken it."""
        self._tries = 0
        self._next_at = 0.0
        self._taken_at: float | None = None
        self._stamp = 0
        self._answered = False
        self._reports: list[TransactionToTower] = []

    def autopilot_came(self, around: Around, now: float) -> None:
        """Does nothing: `due` looks at the line."""

    def begin(self, transaction: Transaction, around: Around | None, now: float) -> None:
        """Makes and keeps a key, or refuses."""
        work, run = transaction.work, TransactionRun(transaction, now)
        assert isinstance(work, SigningWork)
        is_wrong = self._line.state(now) is Signing.WRONG_KEY
        if work.change is SigningChange.REMOVE and is_wrong and self._run is None:
            self._line.forget()
            words = "The key is forgotten. The agent takes what the autopilot sends without a signature."
            self._reports.append(run.result(Outcome.DONE, words))
            self._keep()
            return
        why = "Busy: the signing key is being changed." if self._run is not None else self._why_not(work, around)
        if why is not None:
            self._reports.append(run.result(Outcome.REFUSED, why))
            return
        key = self._make_key() if work.change is SigningChange.NEW_KEY else UNSIGNED
        self._line.offer(key)
        self._run, self._tries, self._next_at = run, 0, now
        self._taken_at, self._answered = None, False
        self._asked = key
        self._keep()

    def _why_not(self, work: SigningWork, around: Around | None) -> str | None:
        if self._store is None:
            return "This agent has no state folder to keep a key in."
        if around is None or not around.heard:
            return f"No heartbeat from the autopilot, so nobody knows whether it is armed. {_ON_THE_GROUND}"
        if around.armed or around.airborne or around.starting or around.holding:
            return f"The drone is {'in the air' if around.airborne else 'armed'}. {_ON_THE_GROUND}"
        if work.change is SigningChange.REMOVE and not self._line.keys[0]:
            return "There is no key: nothing is signed."
        return None

    def cancel(self, transaction_id: int, now: float) -> None:
        """Ends it. The autopilot may have taken the key; then it counts."""
        if self._run is not None and self._run.id == transaction_id:
            self._end(Outcome.CANCELLED, "It was cancelled. If the autopilot took the key, it counts.")

    def epoch_changed(self, epoch: int, now: float) -> None:
        """Ends it if the controls changed hands."""
        if self._run is not None and self._run.epoch != epoch:
            words = "The controls changed hands meanwhile. If the autopilot took the key, it counts."
            self._end(Outcome.STALE_EPOCH, words)

    def receive(self, frame: bytes, now: float) -> bool:
        """Takes the answer to the signed question."""
        if self._taken_at is None:
            return False
        message = decode(frame)
        if message is None or not message.tc1 or message.ts1 != self._stamp:
            return False
        self._answered = True
        return True

    def due(self, around: Around, now: float) -> list[bytes]:
        """Sends the key until it counts, then the question until it is answered."""
        run = self._run
        if run is None:
            # An order to sign no more that came to nothing must not let somebody else's unsigned heartbeat end signing.
            if around.heard and self._line.keys[1:] == (UNSIGNED,):
                self._line.withdraw()
            if self._line.keys != self._kept:  # the autopilot took late what had been offered
                self._keep()
            return []
        try:
            if self._writing is not None and not self._writing():
                if now >= run.deadline:
                    self._end(Outcome.TIMED_OUT, "The disk does not answer. If the autopilot took the key, it counts.")
                return []
        except OSError as error:
            if self._taken_at is None:  # else both keys are on the disk already
                self._line.withdraw()
                self._end(Outcome.FAILED, f"The key cannot be kept ({error.strerror or error}). Nothing was changed.")
                return []
        self._writing = None
        if around.armed:
            self._end(Outcome.FAILED, f"The drone is armed. {_ON_THE_GROUND} If the autopilot took the key, it counts.")
            return []
        if self._taken_at is None and self._line.keys == (self._asked,):
            self._taken_at = self._next_at = now
            self._keep()
            return []
        return self._offer(around, now) if self._taken_at is None else self._ask(run, around, now)

    def _offer(self, around: Around, now: float) -> list[bytes]:
        if now < self._next_at:
            return []
        if self._tries == TRIES:
            if around.heard:  # as before; else it may have taken the key
                self._line.withdraw()
                self._keep()
            self._end(Outcome.FAILED, _NOT_REMOVED if self._asked == UNSIGNED else _NOT_TAKEN)
            return []
        self._tries += 1
        self._next_at = now + SEND_EVERY_S
        ticks = self._line.ticks(self._unix_s()) if self._asked else 0
        return [self._maker.make(setup_signing(around.system_id, self._asked, ticks), agent_sender(around.system_id))]

    def _ask(self, run: TransactionRun, around: Around, now: float) -> list[bytes]:
        assert self._taken_at is not None
        if self._answered:
            words = (
                "Agent and autopilot sign what they send each other. The key stays on the drone."
                if self._asked
                else "Nothing is signed any more."
            )
            self._end(Outcome.DONE, words)
            return []
        if now - self._taken_at >= ANSWERED_WITHIN_S or now >= run.deadline:
            words = "The autopilot took the key, and has not answered since. Take the key away again."
            self._end(Outcome.FAILED, words)
            return []
        if now < self._next_at:
            return []
        self._next_at = now + ASK_EVERY_S
        self._stamp = int(now * 1e9)
        return [self._maker.make(timesync_request(self._stamp), agent_sender(around.system_id))]

    def reports(self) -> list[TransactionToTower]:
        """Returns the messages for the tower once, in order."""
        reports, self._reports = self._reports, []
        return reports

    def resend(self) -> None:
        """Does nothing: the state of the line is part of the autopilot's."""

    def _keep(self) -> None:
        self._kept = self._line.keys
        if self._store is not None:
            self._writing = self._store.keep(self._kept)

    def _end(self, outcome: Outcome, words: str) -> None:
        assert self._run is not None
        self._reports.append(self._run.result(outcome, words))
        self._run = None
