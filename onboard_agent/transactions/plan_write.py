"""Writes one plan to the autopilot, or clears it, by the protocol alone. No I/O; takes `now`.

The autopilot requests the items. This module does not decide whether the plan is on board: an acknowledgement can be
lost, early, or belong to something older. The read-back decides (plan_replacement).

Rules, each tested:
- Every request for an item is answered, however often; requests for an item that is not in the plan never are.
- No item is sent without a request: some autopilots treat a second copy of the last item as an error.
- An error before the first request answers something older.
- A plan without items is sent as MISSION_CLEAR_ALL.
"""

from dataclasses import dataclass
from typing import Any, Final

from onboard_agent.transactions.plan_frames import PlanFrames
from onboard_agent.transactions.plan_words import code_name, sentence
from onboard_agent.transactions.retry_policy import Repeated, RetryPolicy
from wire.dialect import mavlink
from wire.plans import Plan

_REQUESTS: Final = frozenset({"MISSION_REQUEST", "MISSION_REQUEST_INT"})
_PASSING: Final = frozenset({mavlink.MAV_MISSION_OPERATION_CANCELLED, mavlink.MAV_MISSION_INVALID_SEQUENCE})
"""The first belongs to something older; after the second the autopilot requests the right item."""


@dataclass(frozen=True, slots=True)
class Written:
    """The autopilot acknowledged the plan."""


@dataclass(frozen=True, slots=True)
class WriteFailed:
    """The autopilot refused (with `code`), or stopped answering. `item`: of the plan, from 0."""

    why: str
    code: str = ""
    item: int | None = None


class PlanWrite:
    """Call `due` at each tick and after each `receive`, until `end` is set."""

    def __init__(self, talk: PlanFrames, plan: Plan, patience: RetryPolicy) -> None:
        self._talk = talk
        self._patience = patience
        self._items = talk.to_board(plan) if plan else ()
        self._asking = Repeated(patience.tries)
        self._asking.ask(talk.offer(len(self._items)) if plan else talk.clear(), patience.first_s)
        self._out: list[bytes] = []
        self._asked_for: int | None = None
        self._most = 0
        self._heard_at: float | None = None
        self.end: Written | WriteFailed | None = None

    @property
    def progress(self) -> tuple[int, int]:
        """Items sent, and items in the plan, without home."""
        first = self._talk.first if self._items else 0
        return max(self._most - first, 0), len(self._items) - first

    def receive(self, message: Any, now: float) -> None:
        """Takes a message that the autopilot addressed to the agent."""
        if self.end is not None or not self._talk.concerns(message):
            return
        name = message.get_type()
        if name in _REQUESTS:
            self._requested(message.seq, now)
        elif name == "MISSION_ACK":
            self._acknowledged(message.type)

    def due(self, now: float) -> list[bytes]:
        """Frames to send now."""
        if self.end is None:
            self._check_deadlines(now)
        out, self._out = self._out, []
        question = None if self.end is not None else self._asking.due(now)
        return out if question is None else [*out, question]

    def stop(self) -> list[bytes]:
        """Returns the frames that tell the autopilot to abandon the write."""
        return [self._talk.acknowledge(mavlink.MAV_MISSION_OPERATION_CANCELLED)]

    def _requested(self, seq: int, now: float) -> None:
        if seq >= len(self._items):
            return
        self._asking.answered()
        self._heard_at = now
        self._asked_for = seq
        self._most = max(self._most, seq + 1)
        self._out.append(self._talk.item(seq, self._items[seq]))

    def _acknowledged(self, result: int) -> None:
        if result in _PASSING or (result == mavlink.MAV_MISSION_ERROR and self._items and self._asked_for is None):
            return
        if result == mavlink.MAV_MISSION_ACCEPTED:
            self.end = Written()
        else:
            self.end = WriteFailed(sentence(result), code_name(result), self._item)

    def _check_deadlines(self, now: float) -> None:
        if self._asking.given_up(now):
            self.end = WriteFailed("the autopilot does not answer")
        elif self._heard_at is not None and now - self._heard_at >= self._patience.silence_s:
            self.end = WriteFailed("the autopilot stopped requesting items and never confirmed them")

    @property
    def _item(self) -> int | None:
        if self._asked_for is None or self._asked_for < self._talk.first:
            return None
        return self._asked_for - self._talk.first
