"""The interface of a handler: one kind of work at the drone, as `Transactions` and `Onboard` see it. No I/O.

A handler receives the time, frames and the tower's transactions; it returns frames for the autopilot and messages for
the tower. It decides nothing about the flight.
"""

from dataclasses import dataclass
from typing import Protocol

from wire.transactions import Transaction, TransactionToTower


@dataclass(frozen=True, slots=True)
class Around:
    """The present facts about the drone. There are none before the autopilot was heard."""

    system_id: int
    autopilot_kind: int
    """MAV_AUTOPILOT."""
    vehicle_type: int
    """MAV_TYPE."""
    heard: bool
    """Whether it is heard now. A handler may continue what it has begun: its own timeouts end that."""
    armed: bool
    airborne: bool
    custom_mode: int
    starting: bool
    """A mission start was sent to the autopilot, and no heartbeat has shown the result yet."""
    flown_by_hand: bool
    """Armed, and in a mode that needs a hand on the sticks."""
    holding: bool
    """A hold has still something to do: whatever changes the mode stays out of its way."""
    commanded: int
    """Count of flight commands through the tower, and of holds."""
    narrow_line: bool
    """The line to the autopilot has no spare capacity: background work waits while the drone is flown by hand."""
    busy: bool = False
    """Somebody waits for work at the autopilot: a transaction, a read of plans, a ground station's files."""


class TransactionHandler(Protocol):
    """One kind of work. Everything is called from one thread, in the order in which it happens."""

    @property
    def works(self) -> tuple[type, ...]:
        """The work of a Transaction that comes here (wire.transactions.Work), no two handlers the same."""

    @property
    def hears(self) -> frozenset[int]:
        """Ids of the autopilot's messages for `heard`."""

    def autopilot_came(self, around: Around, now: float) -> None:
        """The autopilot is heard for the first time, or again after a silence, or has rebooted."""

    def begin(self, transaction: Transaction, around: Around | None, now: float) -> None:
        """The tower requests one of `works`. `around` None: no autopilot was heard yet.

        It must produce exactly one TransactionResult in time, whatever happens. A write has the present epoch: an older
        one has been refused, a newer one was announced with `epoch_changed`.
        """

    def cancel(self, transaction_id: int, now: float) -> None:
        """The tower cancels it. Ignored for an id that has ended, or that another handler has."""

    def epoch_changed(self, epoch: int, now: float) -> None:
        """This is the epoch now; what writes under another one is given up, and put back where that can be."""

    def receive(self, frame: bytes, now: float) -> bool:
        """A message of `hears` arrived: a whole frame from any sender, with a valid checksum. True: it answers this
        handler alone, and need not go up to the tower."""

    def due(self, around: Around, now: float) -> list[bytes]:
        """Frames to send to the autopilot now. Called at each tick and after each `heard` and `begin`."""

    def news(self) -> list[TransactionToTower]:
        """Reports for the tower, each once, in order. What does not fit waits in Transactions."""

    def resend(self) -> None:
        """The tower may know nothing: the state (not results, not progress) is news again."""
