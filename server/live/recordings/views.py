"""How a recording looks from outside, over REST and on `/live` alike."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

State = Literal["recording", "finishing", "ready", "failed"]


class RecordedByView(BaseModel):
    """Who began it; `id` null where the account is no more."""

    model_config = ConfigDict(frozen=True)

    id: int | None
    name: str


class RecordingView(BaseModel):
    """One recording of a drone's video."""

    model_config = ConfigDict(frozen=True)

    id: int
    drone_id: int
    by: RecordedByView
    state: Annotated[State, Field(description="`ready`: it can be downloaded")]
    words: Annotated[str, Field(description="Why it ended where nobody ended it, or why it failed; for people")]
    quality: Literal["low", "medium", "high"]
    codec: Annotated[Literal["mpeg1", "h264"], Field(description="As it came; the file is always H.264")]
    began_at: datetime
    ended_at: datetime | None
    flights: Annotated[
        list[datetime], Field(description="When the flights that it shows began, as `airborne_since` of the drone")
    ]
    size_bytes: int
    duration_s: Annotated[float | None, Field(description="Of the file")]
    pictures: int
    width: int | None
    height: int | None
