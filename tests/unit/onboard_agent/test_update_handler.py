"""When an agent updates itself: on the ground alone, and only to what was ordered and may be."""

from dataclasses import replace

import pytest
from worlds.around import GROUND

from onboard_agent.transactions.handler import Around
from onboard_agent.update.fetching import Fetched, Fetching, NotFetched
from onboard_agent.update.handler import UpdateHandler
from wire.agent_update import AgentUpdateWork
from wire.transactions import Outcome, Transaction, TransactionProgress, TransactionResult


class Installer:
    """Records what it is told."""

    def __init__(self) -> None:
        self.state: Fetching | Fetched | NotFetched = Fetching(0, 0)
        self.release_keys: tuple[str, ...] = ("key",)
        self.begun: list[str] = []
        self.stopped = 0
        self.switched: list[tuple[str, int]] = []
        self.outcome: tuple[int, bool, str] | None = None
        self.disk_full = False

    def begin(self, version: str) -> None:
        self.begun.append(version)

    def stop(self) -> None:
        self.stopped += 1

    def switch(self, version: str, transaction_id: int) -> None:
        if self.disk_full:
            raise OSError(28, "No space left on device")
        self.switched.append((version, transaction_id))

    def pop_outcome(self) -> tuple[int, bool, str] | None:
        outcome, self.outcome = self.outcome, None
        return outcome


@pytest.fixture
def installer() -> Installer:
    return Installer()


@pytest.fixture
def handler(installer: Installer) -> UpdateHandler:
    return UpdateHandler(installer, running="1.5.0", installed="1.2.0")


def order(version: str, *, older: bool = False) -> Transaction:
    return Transaction(id=7, epoch=1, deadline_s=300, work=AgentUpdateWork(version, older=older))


def result(handler: UpdateHandler) -> TransactionResult:
    (found,) = handler.reports()
    assert isinstance(found, TransactionResult) and found.id == 7
    return found


def test_a_newer_release_is_fetched_and_switched_to(handler: UpdateHandler, installer: Installer) -> None:
    handler.begin(order("1.6.0"), GROUND, 0.0)
    installer.state = Fetching(10, 100)
    handler.due(GROUND, 1.0)
    assert handler.reports() == [TransactionProgress(id=7, phase="fetching", done=10, total=100)]
    assert installer.switched == []
    installer.state = Fetched()
    handler.due(GROUND, 2.0)
    handler.due(GROUND, 3.0)
    assert (installer.begun, installer.switched) == (["1.6.0"], [("1.6.0", 7)])
    assert handler.reports() == [], "the process after the restart reports"


@pytest.mark.parametrize(
    ("around", "words"),
    [
        (None, "No heartbeat"),
        (replace(GROUND, heard=False), "No heartbeat"),
        (replace(GROUND, armed=True), "The drone is armed"),
        (replace(GROUND, airborne=True), "The drone is in the air"),
        (replace(GROUND, holding=True), "on the ground only"),
        (replace(GROUND, starting=True), "on the ground only"),
    ],
)
def test_on_the_ground_only(handler: UpdateHandler, installer: Installer, around: Around | None, words: str) -> None:
    handler.begin(order("1.6.0"), around, 0.0)
    refused = result(handler)
    assert refused.outcome is Outcome.REFUSED and words in refused.words
    assert installer.begun == []


@pytest.mark.parametrize("state", [Fetching(1, 2), Fetched()])
def test_a_drone_that_is_armed_meanwhile_keeps_its_agent(
    handler: UpdateHandler, installer: Installer, state: Fetching | Fetched
) -> None:
    handler.begin(order("1.6.0"), GROUND, 0.0)
    installer.state = state
    handler.due(replace(GROUND, armed=True), 1.0)
    failed = result(handler)
    assert failed.outcome is Outcome.FAILED and "Nothing was changed" in failed.words
    handler.due(GROUND, 2.0)
    assert (installer.switched, installer.stopped) == ([], 1)


@pytest.mark.parametrize(
    ("version", "older", "words"),
    [
        ("1.5.0", True, "is 1.5.0 already"),
        ("1.4.0", False, "nobody asked for an older one"),
        ("1.1.0", True, "only a person can undo it"),
        ("1.x", False, "cannot be compared"),
    ],
)
def test_versions_that_are_refused(
    handler: UpdateHandler, installer: Installer, version: str, older: bool, words: str
) -> None:
    handler.begin(order(version, older=older), GROUND, 0.0)
    refused = result(handler)
    assert refused.outcome is Outcome.REFUSED and words in refused.words
    assert installer.begun == []


def test_an_older_one_that_was_asked_for(handler: UpdateHandler, installer: Installer) -> None:
    handler.begin(order("1.4.0", older=True), GROUND, 0.0)
    assert installer.begun == ["1.4.0"]


def test_without_a_release_key_nothing_is_fetched(handler: UpdateHandler, installer: Installer) -> None:
    installer.release_keys = ()
    handler.begin(order("1.6.0"), GROUND, 0.0)
    assert "no release key" in result(handler).words
    assert installer.begun == []


def test_one_at_a_time(handler: UpdateHandler) -> None:
    handler.begin(order("1.6.0"), GROUND, 0.0)
    handler.begin(order("1.7.0"), GROUND, 0.0)
    assert "Busy" in result(handler).words


def test_ends_without_a_change(handler: UpdateHandler, installer: Installer) -> None:
    handler.begin(order("1.6.0"), GROUND, 0.0)
    handler.cancel(8, 1.0)
    assert handler.reports() == []
    handler.cancel(7, 1.0)
    assert result(handler).outcome is Outcome.CANCELLED
    handler.begin(order("1.6.0"), GROUND, 0.0)
    handler.due(GROUND, 300.0)
    assert result(handler).outcome is Outcome.TIMED_OUT
    handler.begin(order("1.6.0"), GROUND, 0.0)
    installer.state = NotFetched("The package is not what was signed")
    handler.due(GROUND, 1.0)
    assert result(handler).words == "The package is not what was signed. Nothing was changed."
    handler.begin(order("1.6.0"), GROUND, 0.0)
    installer.state, installer.disk_full = Fetched(), True
    handler.due(GROUND, 1.0)
    assert "No space left" in result(handler).words


def test_the_next_process_tells_the_end_once(handler: UpdateHandler, installer: Installer) -> None:
    installer.outcome = (7, False, "The drone is back at 1.5.0.")
    handler.resend()
    told = result(handler)
    assert (told.outcome, told.words) == (Outcome.FAILED, "The drone is back at 1.5.0.")
    handler.resend()
    assert handler.reports() == []
