"""Handler for updates of the agent itself. No I/O: `UpdateInstaller` has disk and network.

Rules, each tested:
- Only on the ground: autopilot heard, disarmed, not airborne, no hold. Asked again before the restart.
- Only a package that a release key of this agent signed, only of the version that was ordered, and only a newer one
  unless the order says otherwise. Never one that is older than what a person installed on the drone.
- The end is reported by the process after the restart: the new one, or the old one that took its place again.
"""

from typing import Final

from onboard_agent.transactions.handler import Around
from onboard_agent.transactions.transaction_run import TransactionRun
from onboard_agent.update.fetching import Fetched, Fetching, NotFetched, UpdateInstaller
from wire.agent_update import AgentUpdateWork, BadPackage, version_key
from wire.transactions import Outcome, Transaction, TransactionResult, TransactionToTower

ON_THE_GROUND: Final = "The agent is updated on the ground only, when the drone is disarmed."


class UpdateHandler:
    """A TransactionHandler. `running`: the version of this process; `installed`: what a person installed."""

    works = (AgentUpdateWork,)
    hears: frozenset[int] = frozenset()

    def __init__(self, installer: UpdateInstaller, *, running: str, installed: str) -> None:
        self._installer = installer
        self._running = running
        self._installed = installed
        self._run: TransactionRun | None = None
        self._version = ""
        self._reports: list[TransactionToTower] = []

    def autopilot_came(self, around: Around, now: float) -> None:
        """Does nothing: `due` looks at the autopilot."""

    def begin(self, transaction: Transaction, around: Around | None, now: float) -> None:
        """Begins to fetch, or refuses."""
        run, work = TransactionRun(transaction, now), transaction.work
        assert isinstance(work, AgentUpdateWork)
        why = "Busy: the agent is being updated." if self._run is not None else self._why_not(work, around)
        if why is not None:
            self._reports.append(run.result(Outcome.REFUSED, why))
            return
        self._run, self._version = run, work.version
        self._installer.begin(work.version)

    def _why_not(self, work: AgentUpdateWork, around: Around | None) -> str | None:
        ground = _why_not_now(around)
        if ground is not None:
            return ground
        if not self._installer.release_keys:
            return "This agent has no release key: set release_keys in its agent.toml."
        try:
            wanted, running, installed = map(version_key, (work.version, self._running, self._installed))
        except BadPackage as error:
            return f"The release {error}."
        if wanted == running:
            return f"The agent is {self._running} already."
        if wanted < installed:
            return (
                f"{work.version} is older than {self._installed}, which a person installed: only a person can undo it."
            )
        if wanted < running and not work.older:
            return f"{work.version} is older than {self._running}, which runs: nobody asked for an older one."
        return None

    def cancel(self, transaction_id: int, now: float) -> None:
        """Ends it at once."""
        if self._run is not None and self._run.id == transaction_id:
            self._end(Outcome.CANCELLED, "It was cancelled. Nothing was changed.")

    def epoch_changed(self, epoch: int, now: float) -> None:
        """Does nothing: an update does not depend on who has the controls."""

    def receive(self, frame: bytes, now: float) -> bool:
        """Hears nothing."""
        return False

    def due(self, around: Around, now: float) -> list[bytes]:
        """Follows the fetching, and switches."""
        run = self._run
        if run is None:
            return []
        state, ground = self._installer.state, _why_not_now(around)
        if ground is not None:
            self._end(Outcome.FAILED, f"{ground} Nothing was changed.")
        elif now >= run.deadline:
            self._end(Outcome.TIMED_OUT, "It timed out. Nothing was changed.")
        elif isinstance(state, Fetching):
            self._reports += run.progress("fetching", state.done, state.total, now)
        elif isinstance(state, NotFetched):
            self._end(Outcome.FAILED, f"{state.why}. Nothing was changed.")
        elif isinstance(state, Fetched):
            self._run = None
            try:
                self._installer.switch(self._version, run.id)
            except OSError as error:
                self._reports.append(run.result(Outcome.FAILED, f"The disk refuses it: {error.strerror or error}."))
        return []

    def reports(self) -> list[TransactionToTower]:
        """Returns the messages for the tower once, in order."""
        reports, self._reports = self._reports, []
        return reports

    def resend(self) -> None:
        """A link is there: tells how the update ended that led to this process."""
        ended = self._installer.pop_outcome()
        if ended is not None:
            transaction_id, runs, words = ended
            outcome = Outcome.DONE if runs else Outcome.FAILED
            self._reports.append(TransactionResult(id=transaction_id, outcome=outcome, words=words))

    def _end(self, outcome: Outcome, words: str) -> None:
        assert self._run is not None
        self._installer.stop()
        self._reports.append(self._run.result(outcome, words))
        self._run = None


def _why_not_now(around: Around | None) -> str | None:
    if around is None or not around.heard:
        return f"No heartbeat from the autopilot, so nobody knows whether it is armed. {ON_THE_GROUND}"
    if around.armed or around.airborne or around.starting or around.holding:
        return f"The drone is {'in the air' if around.airborne else 'armed'}. {ON_THE_GROUND}"
    return None
