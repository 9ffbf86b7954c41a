"""Remembers the capacity of a link for the next stream over it, also across restarts of the video process. No I/O.

The memory is discarded when its connection breaks, when the link to the tower ends, after some minutes, or when the
local address changes: then it is another link.
"""

from typing import Final

import msgspec

from onboard_agent.video.core.link_rate import Known

REMEMBERED_S: Final = 300.0


class Remembered(msgspec.Struct, frozen=True, kw_only=True):
    """`local`: this machine's address on the link. `at`: by CLOCK_MONOTONIC, which all processes share. Other fields as
    in link_rate.Known."""

    local: str
    at: float
    pacing_bps: float
    budget_bps: float
    bound_bps: float | None
    base_s: float


class LinkMemory:
    """Remembers the last link only."""

    def __init__(self, remembered: Remembered | None = None) -> None:
        self.remembered = remembered

    def note(self, known: Known, local: str, now: float) -> None:
        """Records the current knowledge of the link with this local address."""
        self.remembered = Remembered(local=local, at=now, **known._asdict())

    def recall(self, local: str, now: float) -> Known | None:
        """Returns what was known of the link with this local address. None: another link, or too long ago."""
        it = self.remembered
        if it is None or it.local != local or not 0 <= now - it.at <= REMEMBERED_S:
            return None
        return Known(it.pacing_bps, it.budget_bps, it.bound_bps, it.base_s)

    def forget(self) -> None:
        """The link has changed, or behaves as if it had."""
        self.remembered = None
