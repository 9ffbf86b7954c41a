"""The base of a pilot's commands. Nothing else: `commands` and its parts import it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class PilotCommand:
    """Units: degrees, metres above home, metres per second."""

    name: ClassVar[str]
    """The field of `CommandTable`."""
