"""The interface of a handler: one kind of work at the drone, as `Transactions` and `Onboard` use it. No I/O.

A handler receives the time, frames and the tower's transactions; it returns frames for the autopilot and messages for
the tower. It makes no decisions about the flight.
"""

from dataclasses import dataclass
from typing import Protocol

from wire.transactions import Transaction, TransactionToTower


@dataclass(frozen=True, slots=True)
class Around:
    """The known state of the drone at this moment. There is none before the first heartbeat of an autopilot."""

    system_id: int
    autopilot_kind: int
    """MAV_AUTOPILOT."""
    vehicle_type: int
    """MAV_TYPE."""
    heard: bool
    """Whether heartbeats arrive now. A handler may continue what it has begun: its own timeouts end that."""
    armed: bool
    airborne: bool
    custom_mode: int
    starting: bool
    """A mission start was sent to the autopilot, and no heartbeat has shown its effect yet."""
    flown_by_hand: bool
    """Armed, and in a mode that needs stick input."""
    holding: bool
    """A hold is in progress: nothing else may change the mode."""
    commanded: int
    """Counts flight commands through the tower, and holds."""
    narrow_line: bool
    """The line to the autopilot has no spare capacity: background work pauses while the drone is flown by hand."""
    busy: bool = False
    """The autopilot is busy with work that a client waits for: a transaction, the reading of plans, a ground station's
    file transfers."""
    firmware: int = 0
    """flight_sw_version of its AUTOPILOT_VERSION; 0: not known."""
    system_is_fixed: bool = False
    """The agent would not follow the autopilot to another system id."""
    other_systems: tuple[int, ...] = ()
    """Of other autopilots on the line."""


class TransactionHandler(Protocol):
    """One kind of work. All calls come from one thread, in the order of the events."""

    @property
    def works(self) -> tuple[type, ...]:
        """The work types that this handler takes (wire.transactions.Work). No two handlers share a type."""

    @property
    def hears(self) -> frozenset[int]:
        """Ids of the autopilot's messages that `receive` takes."""

    def autopilot_came(self, around: Around, now: float) -> None:
        """The autopilot is heard for the first time, or again after a silence, or has rebooted."""

    def begin(self, transaction: Transaction, around: Around | None, now: float) -> None:
        """Starts a transaction with work of `works`. `around` is None if no autopilot was heard yet.

        It must produce exactly one TransactionResult in time, whatever happens. Writes have the known epoch: older ones
        were refused before, and a newer epoch was announced through `epoch_changed`.
        """

    def cancel(self, transaction_id: int, now: float) -> None:
        """The tower cancels a transaction. Ignores an id that has ended or that belongs to another handler."""

    def epoch_changed(self, epoch: int, now: float) -> None:
        """Sets the current epoch. Writes of another epoch are abandoned, and rolled back where possible."""

    def receive(self, frame: bytes, now: float) -> bool:
        """Takes a whole frame of a type in `hears`, from any sender, with a valid checksum.

        Returns True if the frame answers this handler alone and need not be forwarded to the tower.
        """

    def due(self, around: Around, now: float) -> list[bytes]:
        """Returns the frames to send to the autopilot now. Called at each tick and after each `receive` and `begin`."""

    def reports(self) -> list[TransactionToTower]:
        """Returns the messages for the tower once, in order. Messages that do not fit wait in Transactions."""

    def resend(self) -> None:
        """The tower may know nothing: queues the state again (no results, no progress)."""
