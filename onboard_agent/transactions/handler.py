"""The interface of a handler: one kind of work at the drone, as `Transactions` and `Onboard` see it. No I/O.

A handler receives the time, frames and the tower's transactions; it returns frames for the autopilot and messages for
the tower. It decides nothing about the flight.
"""

from dataclasses import dataclass
from typing import Protocol

from wire.transactions import Transaction, TransactionToTower


@dataclass(frozen=True, slots=True)
class Around:
    """What there is to know about the drone at this moment. Before an autopilot was heard there is none of it."""

    system_id: int
    autopilot_kind: int
    """MAV_AUTOPILOT."""
    vehicle_type: int
    """MAV_TYPE."""
    heard: bool
    """Whether it is heard now. A handler may go on with what it has begun: its own time-outs end that."""
    armed: bool
    airborne: bool
    custom_mode: int
    starting: bool
    """A mission start has gone to the autopilot, and no heartbeat has shown yet what became of it."""
    flown_by_hand: bool
    """Armed, and in a mode that needs a hand on the sticks."""
    holding: bool
    """A hold has still something to do: whatever changes the mode stays out of its way."""
    commanded: int
    """How often somebody has said through the tower how to fly, and how often the drone was made to hold."""
    narrow_line: bool
    """No room to spare on the way to the autopilot: what nobody waits for is not done while it is flown by hand."""
    busy: bool = False
    """Something is under way at the autopilot that somebody waits for: a transaction, plans that are read, a ground
    station's files."""


class TransactionHandler(Protocol):
    """One kind of work. Everything is called from one thread, in the order in which it happens."""

    @property
    def works(self) -> tuple[type, ...]:
        """The work of a Transaction that comes here (wire.transactions.Work), no two handlers the same."""

    @property
    def hears(self) -> frozenset[int]:
        """Ids of the autopilot's messages that `heard` wants to see."""

    def autopilot_came(self, around: Around, now: float) -> None:
        """It is heard for the first time, or again after it was silent, or has rebooted."""

    def begin(self, transaction: Transaction, around: Around | None, now: float) -> None:
        """The tower wants something of `works`. `around` None: no autopilot was heard yet.

        Exactly one TransactionResult must come of it in time, whatever happens. What writes is under the epoch that
        is known: an older one has been refused, a newer one was told with `epoch_changed`.
        """

    def cancel(self, transaction_id: int, now: float) -> None:
        """The tower wants it no more. An id that is over, or that another handler has, says nothing."""

    def epoch_changed(self, epoch: int, now: float) -> None:
        """This is the epoch now; what writes under another one is given up, and put back where that can be."""

    def receive(self, frame: bytes, now: float) -> bool:
        """One of `hears` came, a whole frame from whomever, its checksum holds.

        True: it answers this handler alone, and need not go up to the tower.
        """

    def due(self, around: Around, now: float) -> list[bytes]:
        """Frames to send to the autopilot now. Called at each tick and after each `heard` and `begin`."""

    def news(self) -> list[TransactionToTower]:
        """What is to be told to the tower, once, in order. What does not fit waits in Transactions."""

    def resend(self) -> None:
        """The tower may know nothing: the state (not results, not progress) is news again."""
