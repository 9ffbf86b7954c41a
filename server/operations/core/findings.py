"""What controllers on board have found: the newest reports of one drone. No I/O; takes the time."""

from __future__ import annotations

import base64
from collections import deque
from datetime import datetime
from typing import Annotated, Final

import msgspec
from pydantic import BaseModel, ConfigDict, Field

from wire.findings import InVideo, TargetFound

MAX_FINDINGS: Final = 20
"""The oldest make room: the events have told them."""
MIN_APART_S: Final = 0.2
"""More is no report for people, and would crowd out other events."""
MIN_SIGHTINGS_APART_S: Final = 0.15
"""An agent sends them 0.2 s apart; they may come closer together."""


class InVideoView(BaseModel):
    """Where the live video showed a target: the middle of its box and the box's size, as shares of the picture's width
    and height, from the upper left."""

    model_config = ConfigDict(frozen=True)

    x: float
    y: float
    width: float
    height: float
    age_s: Annotated[float, Field(description="Of the picture when the agent reported it")]

    @classmethod
    def of(cls, box: InVideo | None) -> InVideoView | None:
        return None if box is None else cls(**msgspec.structs.asdict(box))


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
    in_video: Annotated[InVideoView | None, Field(description="Null: the live video did not show it")] = None


class FindingReported(msgspec.Struct, frozen=True, tag="finding", tag_field="type"):
    """A controller on board has found a target."""

    drone_id: int
    finding: FindingView


class TargetSighted(msgspec.Struct, frozen=True, tag="sighting", tag_field="type"):
    """A target is in view of a controller on board. For the eye: nobody keeps it."""

    drone_id: int
    letter: str
    confidence: float
    in_video: InVideoView


FindingEvent = FindingReported | TargetSighted


class Findings:
    """One for each drone."""

    def __init__(self) -> None:
        self._newest: deque[FindingView] = deque(maxlen=MAX_FINDINGS)
        self._number = 0
        self._added_at = self._sighted_at = float("-inf")

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
            in_video=InVideoView.of(found.in_video),
        )
        self._newest.append(view)
        return view

    def sighted(self, found: TargetFound, drone_id: int, now: float) -> TargetSighted | None:
        """Returns the event for browsers; None for one that comes too soon after the last, or is in no video."""
        box = InVideoView.of(found.in_video)
        if box is None or now - self._sighted_at < MIN_SIGHTINGS_APART_S:
            return None
        self._sighted_at = now
        return TargetSighted(drone_id, found.letter, found.confidence, box)
