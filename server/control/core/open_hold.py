"""The open hold of one drone as the tower knows it: the agent's last report, and whether to order it again. No I/O.

An order is pending until a step reports its end. A pending or open hold is ordered again on the next link, because the
agent may be another process, or may never have received it.
"""

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final

from server.fleet.core.views import HoldView
from wire.open_holds import HoldState, LostPhase

MAX_JITTER: Final = timedelta(seconds=1)
"""The agent tells again each 5 s how long it counts; what differs by less is the network, not another countdown."""

NO_ORDER: Final = 0
"""Of a pending hold that was never sent."""

_LOST_WORDS: Final = {
    LostPhase.QUIET: "",
    LostPhase.COUNTING: "counts down to its lost action: {action}",
    LostPhase.STAYED: "stays until the battery is needed for the way home",
    LostPhase.ASKING: "is getting the order of its agent: {action}",
    LostPhase.DONE: "carried out its lost action: {action}",
}


@dataclass
class OpenHold:
    """For one drone, as long as the tower knows it."""

    _reported: HoldState | None = None
    _as_of: datetime | None = None
    _due_at: datetime | None = None
    _fresh: bool = False
    """Told over the link that there is now."""
    _owed: int | None = None
    """The newest order without a reported end."""

    @property
    def must_be_ordered(self) -> bool:
        """Whether a new link is met with an order."""
        return self._owed is not None or (self._reported is not None and self._reported.open)

    @property
    def reported(self) -> HoldState | None:
        """The newest one reported over the present link."""
        return self._reported if self._fresh else None

    # -- orders ----------------------------------------------------------------------------------------------

    def ordered(self, order_id: int = NO_ORDER) -> None:
        """An order was given; NO_ORDER: the drone is offline, or the order is that of a tower before this one."""
        self._owed = order_id

    def ended(self, order_id: int) -> None:
        """A step came that ends this order. One before the newest ends nothing."""
        if order_id != NO_ORDER and order_id == self._owed:
            self._owed = None

    # -- links -----------------------------------------------------------------------------------------------

    def linked(self, *, reports: bool) -> None:
        """An agent signed in. `tells`: it reports open holds; for an agent that does not, there is none."""
        self._fresh = False
        if not reports:
            self._reported, self._owed = None, None

    def link_ended(self) -> None:
        """Keeps the last report as the last known state."""
        self._fresh = False

    # -- the agent's reports ---------------------------------------------------------------------------------

    def take(self, state: HoldState, at: datetime) -> bool:
        """Whether people need to know. False for a report that is not newer than the last one of this link."""
        if self._fresh and self._reported is not None and state.number <= self._reported.number:
            return False
        before = self.view(online=True)
        self._due_at = self._when_due(state, at)
        self._reported, self._as_of, self._fresh = state, at, True
        after = self.view(online=True)
        if before is None or after is None:
            return before is not after
        return before != after.model_copy(update={"as_of": before.as_of})

    def _when_due(self, state: HoldState, at: datetime) -> datetime | None:
        if state.phase is not LostPhase.COUNTING or state.due_in_s is None:
            return None
        due_at = at + timedelta(seconds=min(max(state.due_in_s, 0.0), 86_400.0))
        known = self._due_at
        goes_on = self._reported is not None and self._reported.lost is state.lost and known is not None
        return known if goes_on and known is not None and abs(due_at - known) <= MAX_JITTER else due_at

    # -- messages for people ---------------------------------------------------------------------------------

    def view(self, *, online: bool) -> HoldView | None:
        """None if there is no open hold, no loss, and no lost action running or just done."""
        reported, as_of = self._reported, self._as_of
        if (
            reported is None
            or as_of is None
            or not (reported.open or reported.lost or reported.phase is not LostPhase.QUIET)
        ):
            return None
        return HoldView(
            open=reported.open,
            stage=reported.stage,
            mode=reported.mode,
            sticks=reported.sticks,
            after_sticks=reported.after_sticks,
            waiting_for=reported.waiting_for,
            lost=reported.lost,
            phase=reported.phase,
            action=reported.action,
            due_at=self._due_at,
            detail=reported.detail,
            as_of=as_of,
            stale=not (self._fresh and online),
        )

    def last_words(self) -> str:
        """The agent's last report as a sentence; empty if it reported neither a hold nor a loss."""
        reported = self._reported
        if reported is None or self.view(online=False) is None:
            return ""
        action = reported.action.value if reported.action is not None else "not known"
        parts = [
            f"held in {reported.mode} (stage: {reported.stage.value})" if reported.open else f"was in {reported.mode}",
            _LOST_WORDS[reported.phase].format(action=action),
        ]
        return f"By the last report of its agent, it {', and '.join(part for part in parts if part)}."
