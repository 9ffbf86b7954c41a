"""What the rules about the tower itself judge: its disks, its TLS certificate, its pace. None is unknown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum

from server.alerts.core.finding import Finding


class StoredThere(StrEnum):
    """What a disk of the tower holds, in words."""

    DATA = "the tower's data"
    FILES = "the tower's recordings"
    BOTH = "the tower's data and recordings"


@dataclass(frozen=True, slots=True)
class Disk:
    """`free_bytes`: what the tower may still use."""

    holds: StoredThere
    free_bytes: int


@dataclass(frozen=True, slots=True)
class Certificate:
    """`where`: the file or the address that it was read from."""

    where: str
    ends_at: datetime


@dataclass(frozen=True, slots=True)
class StoodStill:
    """The longest time in the last minute for which nothing was passed on, and the code that took it."""

    for_s: float
    where: str


@dataclass(frozen=True, slots=True)
class PartFails:
    """A part of the tower in which errors came in the last minutes that nothing else noticed, and how many."""

    part: str
    errors: int


@dataclass(frozen=True, kw_only=True, slots=True)
class TowerFacts:
    """`disk`: the one with the least free space. `disk_low_bytes`: the limit of the warning; 0: there is none.
    `stood_still` None: it did not. `database_fault`: what is wrong with its file; empty: nothing is known to be.
    `failing`: the part with the most errors."""

    disk: Disk | None = None
    disk_low_bytes: int = 0
    certificate: Certificate | None = None
    stood_still: StoodStill | None = None
    database_fault: str = ""
    failing: PartFails | None = None


TowerCondition = Callable[[TowerFacts, datetime, bool], Finding]
"""Takes the facts, the time of day, and whether the alert is open."""
