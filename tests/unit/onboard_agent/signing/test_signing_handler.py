"""The signing key is set up, changed and taken away: never so that autopilot and agent end up apart."""

from collections.abc import Callable
from dataclasses import replace

import pytest
from signing_autopilot import SigningAutopilot
from worlds.around import GROUND

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.signing.handler import SigningHandler
from onboard_agent.signing.signed_line import UNSIGNED, Keys, SignedLine
from onboard_agent.transactions.handler import Around
from wire.frames import message_id
from wire.signing_key import SigningChange, SigningWork
from wire.transactions import Outcome, Transaction, TransactionResult

OLD, NEW = bytes([1] * 32), bytes([2] * 32)


class Store:
    """A disk. `slow`: it writes nothing until that ends."""

    def __init__(self, keys: Keys = ()) -> None:
        self.keys = keys
        self.slow = False
        self.error: OSError | None = None
        self._waiting: list[Keys] = []

    def keep(self, keys: Keys) -> Callable[[], bool]:
        self._waiting.append(keys)
        if not self.slow and self.error is None:
            self.finish()

        def is_kept() -> bool:
            if self.slow:
                return False
            if self.error is not None:
                raise self.error
            self.finish()
            return True

        return is_kept

    def finish(self) -> None:
        for keys in self._waiting:
            self.keys = keys
        self._waiting.clear()


class Signed:
    """Handler, line and autopilot in one simulated time."""

    def __init__(self, key: bytes = UNSIGNED, *, store: Store | None = None) -> None:
        self.now = 0.0
        self.around = GROUND
        self.store = store or Store((key,) if key else ())
        self.line = SignedLine(self.store.keys)
        self.autopilot = SigningAutopilot()
        if key:
            self.autopilot.sign(key)
        self.cut = False
        """Nothing reaches the autopilot."""
        self.sent: list[bytes] = []
        self.handler = SigningHandler(
            FrameMaker(), self.line, self.store, unix_s=lambda: 1_800_000_000.0 + self.now, make_key=lambda: NEW
        )

    def ask(self, change: SigningChange, *, number: int = 7) -> None:
        work = Transaction(id=number, epoch=1, deadline_s=20, work=SigningWork(change))
        self.handler.begin(work, self.around, self.now)

    def pass_time(self, seconds: float) -> None:
        until = self.now + seconds
        while self.now < until:
            self.now += 0.1
            frames = self.handler.due(self.around, self.now)
            self.sent += frames
            out = [self.line.sign(frame, 1_800_000_000.0 + self.now) for frame in frames]
            answers = self.autopilot.receive([] if self.cut else out)
            if round(self.now * 10) % 10 == 0:
                answers += self.autopilot.heartbeat()
            for frame in self.line.open(answers, self.now):
                if message_id(frame) in self.handler.hears:
                    self.handler.receive(frame, self.now)

    def results(self) -> list[tuple[Outcome, str]]:
        return [(one.outcome, one.words) for one in self.handler.reports() if isinstance(one, TransactionResult)]

    def result(self) -> tuple[Outcome, str]:
        (found,) = self.results()
        return found


def test_a_key_is_set_up() -> None:
    signed = Signed()
    signed.ask(SigningChange.NEW_KEY)
    signed.pass_time(3.0)
    assert signed.result() == (
        Outcome.DONE,
        "Agent and autopilot sign what they send each other. The key stays on the drone.",
    )
    assert signed.line.keys == signed.store.keys == (NEW,)
    assert signed.autopilot.keys == [NEW]


def test_another_key_takes_the_place_of_the_first() -> None:
    signed = Signed(OLD)
    signed.ask(SigningChange.NEW_KEY)
    signed.pass_time(3.0)
    assert signed.result()[0] is Outcome.DONE
    assert signed.line.keys == signed.store.keys == (NEW,)


def test_the_key_is_taken_away() -> None:
    signed = Signed(OLD)
    signed.ask(SigningChange.REMOVE)
    signed.pass_time(3.0)
    assert signed.result() == (Outcome.DONE, "Nothing is signed any more.")
    assert signed.line.is_plain and signed.store.keys == (UNSIGNED,)
    signed.ask(SigningChange.REMOVE)
    assert signed.result() == (Outcome.REFUSED, "There is no key: nothing is signed.")


def test_nothing_is_sent_before_it_is_kept() -> None:
    signed = Signed()
    signed.store.slow = True
    signed.ask(SigningChange.NEW_KEY)
    signed.pass_time(2.0)
    assert signed.sent == []
    signed.store.slow = False
    signed.pass_time(3.0)
    assert signed.result()[0] is Outcome.DONE


def test_a_full_disk_changes_nothing() -> None:
    signed = Signed(OLD)
    signed.store.error = OSError(28, "No space left on device")
    signed.ask(SigningChange.NEW_KEY)
    signed.pass_time(2.0)
    assert signed.result() == (
        Outcome.FAILED,
        "The key cannot be kept (No space left on device). Nothing was changed.",
    )
    assert signed.sent == [] and signed.line.keys == (OLD,)


@pytest.mark.parametrize("change", SigningChange)
def test_an_autopilot_that_does_not_take_it_keeps_what_was(change: SigningChange) -> None:
    signed = Signed(OLD)
    signed.autopilot.takes_keys = False
    signed.ask(change)
    signed.pass_time(8.0)
    outcome, words = signed.result()
    assert outcome is Outcome.FAILED
    assert "did not take the key" in words if change is SigningChange.NEW_KEY else "goes on signing" in words
    assert signed.line.keys == signed.store.keys == (OLD,)


def test_a_key_that_is_taken_late_counts_all_the_same() -> None:
    """Its heartbeats were lost when the agent gave up: nobody could know that it had taken the key."""
    signed = Signed()
    signed.cut = True
    signed.ask(SigningChange.NEW_KEY)
    signed.pass_time(2.0)
    signed.around = replace(GROUND, heard=False)
    signed.pass_time(6.0)
    assert signed.result()[0] is Outcome.FAILED
    assert signed.store.keys == (UNSIGNED, NEW)
    signed.around = GROUND
    signed.autopilot.sign(NEW)
    signed.pass_time(1.5)
    assert signed.line.keys == signed.store.keys == (NEW,)


def test_an_agent_that_dies_in_between_knows_both_keys() -> None:
    for taken in (False, True):
        signed = Signed(OLD)
        signed.ask(SigningChange.NEW_KEY)
        signed.pass_time(0.1)
        assert signed.store.keys == (OLD, NEW)
        again = SignedLine(signed.store.keys)
        signed.autopilot.sign(NEW if taken else OLD, 1 << 47)
        assert len(again.open(signed.autopilot.heartbeat(), 0.0)) == 1
        assert again.keys == ((NEW,) if taken else (OLD, NEW))


def test_one_that_answers_no_signed_question_is_told() -> None:
    signed = Signed()
    signed.autopilot.answers = False
    signed.ask(SigningChange.NEW_KEY)
    signed.pass_time(8.0)
    assert signed.result() == (
        Outcome.FAILED,
        "The autopilot took the key, and has not answered since. Take the key away again.",
    )
    assert signed.line.keys == (NEW,)


@pytest.mark.parametrize(
    ("around", "words"),
    [
        (None, "No heartbeat"),
        (replace(GROUND, heard=False), "No heartbeat"),
        (replace(GROUND, armed=True), "armed"),
        (replace(GROUND, airborne=True, armed=True), "in the air"),
        (replace(GROUND, holding=True), "on the ground only"),
    ],
)
def test_only_on_the_ground_and_disarmed(around: Around | None, words: str) -> None:
    signed = Signed()
    work = Transaction(id=7, epoch=1, deadline_s=20, work=SigningWork(SigningChange.NEW_KEY))
    signed.handler.begin(work, around, 0.0)
    outcome, said = signed.result()
    assert outcome is Outcome.REFUSED and words in said
    assert signed.line.is_plain


def test_arming_ends_it() -> None:
    signed = Signed()
    signed.autopilot.takes_keys = False
    signed.ask(SigningChange.NEW_KEY)
    signed.pass_time(1.2)
    signed.around = replace(GROUND, armed=True)
    before = len(signed.sent)
    signed.pass_time(3.0)
    outcome, words = signed.result()
    assert outcome is Outcome.FAILED and "armed" in words
    assert len(signed.sent) == before


def test_a_second_request_waits_for_nothing_and_breaks_nothing() -> None:
    signed = Signed()
    signed.ask(SigningChange.NEW_KEY)
    signed.ask(SigningChange.REMOVE, number=8)
    signed.pass_time(3.0)
    outcomes = [outcome for outcome, _ in signed.results()]
    assert outcomes == [Outcome.REFUSED, Outcome.DONE]


def test_it_ends_when_it_is_cancelled_and_when_the_controls_change_hands() -> None:
    for end, outcome in (
        (lambda handler: handler.cancel(7, 1.0), Outcome.CANCELLED),
        (lambda handler: handler.epoch_changed(2, 1.0), Outcome.STALE_EPOCH),
    ):
        signed = Signed()
        signed.autopilot.takes_keys = False
        signed.ask(SigningChange.NEW_KEY)
        signed.pass_time(1.0)
        end(signed.handler)
        assert signed.result()[0] is outcome
        before = len(signed.sent)
        signed.pass_time(3.0)
        assert len(signed.sent) == before


def test_a_key_that_does_not_fit_is_forgotten_even_though_nothing_is_heard() -> None:
    signed = Signed(OLD)
    signed.autopilot.sign(UNSIGNED)
    signed.line.open(signed.autopilot.heartbeat(), signed.now)
    work = Transaction(id=7, epoch=1, deadline_s=20, work=SigningWork(SigningChange.REMOVE))
    signed.handler.begin(work, None, signed.now)
    assert signed.result()[0] is Outcome.DONE
    assert signed.line.is_plain
    assert signed.store.keys == (UNSIGNED,)


def test_an_agent_without_a_disk_takes_no_key() -> None:
    handler = SigningHandler(FrameMaker(), SignedLine(), None, unix_s=lambda: 0.0)
    work = Transaction(id=7, epoch=1, deadline_s=20, work=SigningWork(SigningChange.NEW_KEY))
    handler.begin(work, GROUND, 0.0)
    (found,) = handler.reports()
    assert isinstance(found, TransactionResult) and "no state folder" in found.words


@pytest.mark.parametrize("dies", [False, True])
def test_a_removal_that_came_to_nothing_leaves_no_way_round_the_key(dies: bool) -> None:
    signed = Signed(OLD)
    signed.autopilot.takes_keys = False
    signed.ask(SigningChange.REMOVE)
    signed.pass_time(1.0)
    if dies:
        store, signed = signed.store, Signed(OLD, store=signed.store)
        assert store.keys == (OLD, UNSIGNED)
        signed.autopilot.sign(OLD, 1 << 47)
    else:
        signed.handler.cancel(7, signed.now)
    signed.pass_time(1.5)
    stranger = SigningAutopilot().heartbeat()
    assert signed.line.open(stranger, signed.now) == []
    assert signed.line.keys == signed.store.keys == (OLD,)


def test_a_disk_that_never_answers_ends_it_in_time() -> None:
    signed = Signed()
    signed.store.slow = True
    signed.ask(SigningChange.NEW_KEY)
    signed.pass_time(21.0)
    assert signed.result()[0] is Outcome.TIMED_OUT
    assert signed.sent == []
