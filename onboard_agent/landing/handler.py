"""Sends LANDING_TARGET while the drone flies and its landing pad is in sight. No I/O.

The process that looks for the pad runs only while the drone is armed: a camera and a detector cost power.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.landing.sighting_line import SightingLine
from onboard_agent.landing.target_sender import TargetSender
from onboard_agent.transactions.handler import Around
from wire.transactions import Transaction, TransactionToTower


class PadPort(Protocol):
    """The process that looks for the pad. The shell is `onboard_agent.landing.child`."""

    def look(self, wanted: bool) -> None:
        """Starts the process, or ends it. Nothing changes if it is already so."""

    def sightings(self) -> Sequence[SightingLine]:
        """Returns those since the last call, in order."""


class LandingTargetHandler:
    """A TransactionHandler that takes no work: it sends by itself. `make_port` is called when the drone is first
    armed."""

    works: tuple[type, ...] = ()
    hears: frozenset[int] = frozenset()

    def __init__(self, maker: FrameMaker, make_port: Callable[[], PadPort]) -> None:
        self._make_port = make_port
        self._port: PadPort | None = None
        self._sender = TargetSender(maker)

    def due(self, around: Around, now: float) -> list[bytes]:
        """Returns the LANDING_TARGET that is due."""
        wanted = around.heard and around.armed
        if self._port is None and not wanted:
            return []
        self._port = port = self._port or self._make_port()
        port.look(wanted)
        for line in port.sightings():
            self._sender.saw(line.target, line.taken_s)
        return self._sender.due(around.system_id, now) if wanted and around.airborne else []

    # It has no work of the tower's.

    def autopilot_came(self, around: Around, now: float) -> None:
        """Does nothing."""

    def begin(self, transaction: Transaction, around: Around | None, now: float) -> None:
        """Is never called: `works` is empty."""

    def cancel(self, transaction_id: int, now: float) -> None:
        """Does nothing."""

    def epoch_changed(self, epoch: int, now: float) -> None:
        """Does nothing."""

    def receive(self, frame: bytes, now: float) -> bool:
        """Is never called: `hears` is empty."""
        return False

    def reports(self) -> list[TransactionToTower]:
        """Returns nothing."""
        return []

    def resend(self) -> None:
        """Does nothing."""
