"""Reports the open hold and the lost action to the tower in one message when due. No I/O; takes `now`."""

from typing import Final

import msgspec

from onboard_agent.autopilot.autopilot_state import AutopilotView
from onboard_agent.autopilot.inquiry import Inquiry
from onboard_agent.autopilot.mode_names import mode_name
from onboard_agent.failsafe.failsafe import Failsafe
from onboard_agent.failsafe.hold import Hold
from wire.open_holds import AfterSticks, HoldStage, HoldState, LostPhase

EVERY_S: Final = 5.0
SAME_COUNT_S: Final = 0.5
"""A countdown that runs as reported is not reported again."""
SAME_PERCENT: Final = 5.0
"""Smaller changes are not reported: the autopilot reports whole percent, from which the consumption is estimated."""
MAX_TEXT_LENGTH: Final = 300


class HoldStateReporter:
    """Call `changed` often."""

    def __init__(self, *, autopilot: AutopilotView, hold: Hold, failsafe: Failsafe, inquiry: Inquiry) -> None:
        self._autopilot = autopilot
        self._hold = hold
        self._failsafe = failsafe
        self._inquiry = inquiry
        self._sent: HoldState | None = None
        self._sent_at = 0.0
        self._number = 0
        self._needed_percent = 0.0

    def resend(self) -> None:
        """Reports everything again on a new tower link."""
        self._sent = None

    def changed(self, now: float) -> HoldState | None:
        """Returns the report for the tower if it changed or, in a hold or loss, is older than EVERY_S; else None."""
        state = self._state(now)
        sent = self._sent
        if sent is not None:
            going_on = state.open or state.phase is not LostPhase.QUIET
            if self._same(state, sent, now) and not (going_on and now - self._sent_at >= EVERY_S):
                return None
        self._sent, self._sent_at = state, now
        self._number += 1
        return msgspec.structs.replace(state, number=self._number)

    def _same(self, state: HoldState, sent: HoldState, now: float) -> bool:
        plain = msgspec.structs.replace
        if plain(state, due_in_s=None) != plain(sent, due_in_s=None):
            return False
        if state.due_in_s is None or sent.due_in_s is None:
            return state.due_in_s == sent.due_in_s
        return abs(sent.due_in_s - (now - self._sent_at) - state.due_in_s) < SAME_COUNT_S

    def _state(self, now: float) -> HoldState:
        view, hold, lost = self._autopilot, self._hold, self._failsafe.lost
        lost_is_known = lost.phase is not LostPhase.QUIET
        detail = hold.why if hold.open else ""
        if lost.phase is LostPhase.STAYED:
            needed_percent = self._failsafe.needed_percent
            if abs(needed_percent - self._needed_percent) > SAME_PERCENT:
                self._needed_percent = needed_percent
            detail = f"it stays; at {self._needed_percent:.0f} % of its battery it goes home"
        elif lost_is_known and lost.phase is not LostPhase.COUNTING:
            detail = lost.detail  # the countdown itself has fields of its own
        if hold.open and view.failsafe.active:
            detail = f"the autopilot: {view.failsafe.words}"
        return HoldState(
            number=0,
            open=hold.open,
            stage=hold.stage if hold.open else HoldStage.NONE,
            mode=mode_name(view.kind, view.vehicle_type, view.custom_mode) if view.heard else "",
            sticks=hold.sticks_on or self._failsafe.keeps_sticks,
            after_sticks=(
                self._inquiry.after_sticks(view.kind, view.custom_mode, now)
                if view.may_be_held
                else AfterSticks.UNKNOWN
            ),
            waiting_for=hold.waiting_for[:MAX_TEXT_LENGTH] if hold.open else "",
            lost=lost.lost if lost_is_known else None,
            phase=lost.phase,
            action=lost.action if lost_is_known else None,
            due_in_s=None if lost.due_in_s is None else round(lost.due_in_s, 2),
            detail=detail[:MAX_TEXT_LENGTH],
        )
