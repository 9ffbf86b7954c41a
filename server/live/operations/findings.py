"""What controllers on board have found: the newest reports of one drone. No I/O; takes the time."""

from __future__ import annotations

import base64
from collections import deque
from datetime import datetime
from typing import Annotated, Final

import msgspec
from pydantic import BaseModel, ConfigDict, Field

from wire.findings import TargetFound

MAX_FINDINGS: Final = 20
"""The oldest make room: the events have told them."""
MIN_APART_S: Final = 0.2
"""More is no report for people, and would crowd out other events."""


class FindingView(BaseModel):
    """A target that a controller on board reported."""

    model_config = ConfigDict(frozen=True)

    number: Annotated[int, Field(description="Counts the drone's findings since the tower started")]
    at: datetime
    letter: Annotated[str, Field(description="Empty: none was read")]
    confidence: Annotated[float, Field(description="0 to 1: a rank, no probability")]
    lat_deg: float
    lon_deg: float
    thumbnail: Annotated[str, Field(description="A JPEG in base64; empty: none")]


class FindingReported(msgspec.Struct, frozen=True, tag="finding", tag_field="type"):
    """A controller on board has found a target."""

    drone_id: int
    finding: FindingView


class Findings:
    """One for each drone."""

    def __init__(self) -> None:
        self._newest: deque[FindingView] = deque(maxlen=MAX_FINDINGS)
        self._number = 0
        self._added_at = float("-inf")

    @property
    def newest(self) -> list[FindingView]:
        """Newest first."""
        return list(reversed(self._newest))

    def add(self, found: TargetFound, at: datetime, now: float) -> FindingView | None:
        """Returns what was added; None for one that comes too soon after the last."""
        if now - self._added_at < MIN_APART_S:
            return None
        self._added_at = now
        self._number += 1
        view = FindingView(
            number=self._number,
            at=at,
            letter=found.letter,
            confidence=found.confidence,
            lat_deg=found.lat_deg,
            lon_deg=found.lon_deg,
            thumbnail=base64.b64encode(found.thumbnail).decode(),
        )
        self._newest.append(view)
        return view
