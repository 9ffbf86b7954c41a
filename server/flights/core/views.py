"""How a recorded flight looks from outside."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

State = Literal["recording", "ready", "failed"]


class PilotView(BaseModel):
    """Somebody who had the controls; `id` null if the account was deleted."""

    model_config = ConfigDict(frozen=True)

    id: int | None
    name: str


class FlightView(BaseModel):
    """One flight, from arming to disarming."""

    model_config = ConfigDict(frozen=True)

    id: int
    drone_id: int
    drone: str
    pilots: list[PilotView]
    state: Annotated[State, Field(description="`ready`: it can be downloaded; `failed`: its files cannot be read")]
    words: Annotated[str, Field(description="Why the recording ended, if not by disarming; for people")]
    began_at: Annotated[datetime, Field(description="Armed")]
    ended_at: Annotated[datetime | None, Field(description="Disarmed, or the last frame")]
    duration_s: float | None
    distance_m: Annotated[float | None, Field(description="Over ground")]
    max_height_m: Annotated[float | None, Field(description="Above home")]
    track: Annotated[list[tuple[float, float]], Field(description="Up to 200 positions, latitude and longitude")]
    frames: int
    lost_frames: Annotated[int, Field(description="Passed on, and not recorded: the disk was too slow or full")]
    size_bytes: int


class FlightPageView(BaseModel):
    """Newest first."""

    flights: list[FlightView]
    next: Annotated[str | None, Field(description="For `before`: the next page; null: there is none")]


class FlightVideoView(BaseModel):
    """A recording of video during the flight."""

    id: int
    began_at: datetime
    first_picture_at: Annotated[
        datetime | None, Field(description="When its first picture was taken; null: none came yet, or an old recording")
    ]
    ended_at: datetime | None
    quality: str
    state: str

    @property
    def shows_from(self) -> datetime:
        """The moment at which its file begins, as far as it is known."""
        return self.first_picture_at or self.began_at


class FlightDetailView(FlightView):
    """One flight with its index."""

    video: list[FlightVideoView]
    index: Annotated[list[dict[str, Any]], Field(description="What happened, as docs/flights.md lists it")]
    index_is_whole: Annotated[bool, Field(description="False: there was more than is kept")]
