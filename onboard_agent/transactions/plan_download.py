"""Downloads one plan from the autopilot: MISSION_REQUEST_LIST, then its items. No I/O; takes `now`.

An autopilot that answers each request by itself (`PlanFrames.asks_ahead`) is asked for several items at once: it polls
its line a few hundred times a second, so that 200 items would take a second one by one.

Rules, each tested:
- An item counts only if it was requested; duplicates and unexpected items change nothing.
- A count that changes means another plan: the download restarts, a few times.
- A late answer to the previous upload ends nothing.
- An autopilot that denies the download still waits for an abandoned upload: the request is repeated until that lapses.
"""

from dataclasses import dataclass
from typing import Any, Final

from onboard_agent.transactions.plan_frames import PlanFrames
from onboard_agent.transactions.plan_words import code_name, sentence
from onboard_agent.transactions.retry_policy import Repeated, RetryPolicy
from wire.dialect import mavlink
from wire.plans import MAX_ITEMS_ANY, Plan, PlanItem, read_item

MAX_RESTARTS: Final = 3
_PASSING: Final = frozenset(
    {
        mavlink.MAV_MISSION_ACCEPTED,
        mavlink.MAV_MISSION_ERROR,
        mavlink.MAV_MISSION_INVALID_SEQUENCE,
        mavlink.MAV_MISSION_OPERATION_CANCELLED,
    }
)
"""These may be late answers to the previous upload: they do not end the download, but are reported if it fails."""


@dataclass(frozen=True, slots=True)
class Downloaded:
    """The complete plan (without home)."""

    plan: Plan


@dataclass(frozen=True, slots=True)
class DownloadFailed:
    """`why`: part of a sentence. `code`: name of the MAV_MISSION_RESULT, or empty."""

    why: str
    code: str = ""
    item: int | None = None


class PlanDownload:
    """Call `due` at each tick and after each `receive`, until `end` is set."""

    def __init__(self, talk: PlanFrames, patience: RetryPolicy, *, wait_s: float = 0.0) -> None:
        """`wait_s`: delay from the first `due` to the first request."""
        self._talk = talk
        self._wait_s = wait_s
        self._begins_at: float | None = None
        self._patience = patience
        self._asking = Repeated(patience.tries)
        self._asking.ask(talk.ask_count(), patience.first_s)
        self._out: list[bytes] = []
        self._count: int | None = None
        self._items: dict[int, PlanItem] = {}
        """By the autopilot's item number."""
        self._asked: dict[int, Repeated] = {}
        """Requested items that have not arrived, in order."""
        self._restarts = 0
        self._denied_since: float | None = None
        self._last_no: int | None = None
        self.end: Downloaded | DownloadFailed | None = None

    @property
    def progress(self) -> tuple[int, int]:
        """Items read, and items in total (0 until known), without home."""
        first = self._talk.first
        return max(len(self._items) - first, 0), max((self._count or 0) - first, 0)

    def receive(self, message: Any, now: float) -> None:
        """Takes a message that the autopilot addressed to the agent."""
        if self.end is not None or not self._talk.concerns(message):
            return
        name = message.get_type()
        if name == "MISSION_COUNT":
            self._counted(message.count)
        elif name == "MISSION_ITEM_INT":
            self._item(message)
        elif name == "MISSION_ACK":
            self._acknowledged(message.type, now)

    def due(self, now: float) -> list[bytes]:
        """Frames to send now."""
        if self._begins_at is None:
            self._begins_at = now + self._wait_s
        if now < self._begins_at:
            return []
        if self.end is None and any(one.given_up(now) for one in self._questions):
            self._give_up()
        out, self._out = self._out, []
        if self.end is None:
            out += [question for one in self._questions if (question := one.due(now)) is not None]
        return out

    @property
    def _questions(self) -> list[Repeated]:
        return [self._asking, *self._asked.values()]

    def _counted(self, count: int) -> None:
        if self._count == count:
            return  # an answer to a repeated request
        if self._count is not None:
            self._restarts += 1
            if self._restarts > MAX_RESTARTS:
                self.end = DownloadFailed("the plan on board kept changing while it was read")
                return
        if count > MAX_ITEMS_ANY + self._talk.first:
            self.end = DownloadFailed(f"the autopilot says that it has {count} items, more than {MAX_ITEMS_ANY}")
            return
        self._forget_items()
        self._count, self._last_no = count, None
        self._asking.answered()
        self._ask_on()

    def _item(self, message: Any) -> None:
        if self._asked.pop(message.seq, None) is None:
            return
        try:
            self._items[message.seq] = read_item(message)
        except ValueError:
            item = message.seq - self._talk.first
            self.end = DownloadFailed("the autopilot tells an item that has no number where one must be", item=item)
            return
        self._ask_on()

    def _ask_on(self) -> None:
        assert self._count is not None
        for seq in range(len(self._items) + len(self._asked), self._count):
            if len(self._asked) == self._talk.asks_ahead:
                return
            self._asked[seq] = Repeated(self._patience.tries)
            self._asked[seq].ask(self._talk.ask_item(seq), self._patience.next_s)
        if not self._asked:
            self._out.append(self._talk.acknowledge(mavlink.MAV_MISSION_ACCEPTED))
            self.end = Downloaded(self._talk.from_board(tuple(self._items[seq] for seq in range(self._count))))

    def _forget_items(self) -> None:
        self._items.clear()
        self._asked.clear()

    def _acknowledged(self, result: int, now: float) -> None:
        if result in _PASSING:
            self._last_no = None if result == mavlink.MAV_MISSION_ACCEPTED else result
            return
        if result == mavlink.MAV_MISSION_DENIED:
            self._denied_since = now if self._denied_since is None else self._denied_since
            if now - self._denied_since < self._patience.busy_s:
                self._count = None
                self._forget_items()
                self._asking.ask(self._talk.ask_count(), self._patience.first_s)
                self._asking.postpone(now)
                return
        self.end = DownloadFailed(sentence(result), code_name(result), self._item_asked)

    def _give_up(self) -> None:
        if self._last_no is not None:
            self.end = DownloadFailed(sentence(self._last_no), code_name(self._last_no), self._item_asked)
        elif not self._asked:
            self.end = DownloadFailed("the autopilot does not answer when it is asked for its plan")
        else:
            number = min(self._asked) - self._talk.first + 1
            asked = f"item {number}" if number > 0 else "home"
            self.end = DownloadFailed(f"the autopilot does not answer when it is asked for {asked}")

    @property
    def _item_asked(self) -> int | None:
        item = min(self._asked, default=-1) - self._talk.first
        return item if item >= 0 else None
