"""What a link carried, kept for the next stream over it: also over the video process's end and start. No I/O.

It goes with the connection that breaks, with the link to the tower, after some minutes, and where another local address
leads to the tower: then it is another link.
"""

from typing import Final

import msgspec

from onboard_agent.video.core.link_rate import Known

REMEMBERED_S: Final = 300.0


class Remembered(msgspec.Struct, frozen=True, kw_only=True):
    """`local`: this machine's address on that link. `at`: by CLOCK_MONOTONIC, which all its processes share. The rest
    as in link_rate.Known."""

    local: str
    at: float
    pacing_bps: float
    budget_bps: float
    bound_bps: float | None
    base_s: float


class LinkMemory:
    """Of the last link."""

    def __init__(self, remembered: Remembered | None = None) -> None:
        self.remembered = remembered

    def note(self, known: Known, local: str, now: float) -> None:
        """What is known now of the link with this local address."""
        self.remembered = Remembered(local=local, at=now, **known._asdict())

    def recall(self, local: str, now: float) -> Known | None:
        """What was known of the link with this local address. None: it is not the same, or it was too long ago."""
        it = self.remembered
        if it is None or it.local != local or not 0 <= now - it.at <= REMEMBERED_S:
            return None
        return Known(it.pacing_bps, it.budget_bps, it.bound_bps, it.base_s)

    def forget(self) -> None:
        """The link is another one, or behaves so."""
        self.remembered = None
