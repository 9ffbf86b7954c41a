"""How an imported flight looks from outside, and how it stands in its file."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Format = Literal["tlog", "dataflash", "ulog"]


class UploaderView(BaseModel):
    model_config = ConfigDict(frozen=True)

    id: int
    name: str


class ClockJumpView(BaseModel):
    model_config = ConfigDict(frozen=True)

    at: datetime
    by_s: Annotated[float, Field(description="Negative: back")]


class ImportedFlightView(BaseModel):
    """A flight from a file of another program. It belongs to whoever uploaded it, and to no drone of the tower."""

    model_config = ConfigDict(frozen=True)

    id: Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")]
    name: Annotated[str, Field(description="Of the file that was uploaded")]
    format: Annotated[Format, Field(description="`tlog`, ArduPilot's `dataflash` (.bin) or PX4's `ulog` (.ulg)")]
    by: UploaderView
    uploaded_at: datetime
    began_at: Annotated[datetime, Field(description="Of the first frame")]
    ended_at: Annotated[datetime, Field(description="Of the last frame")]
    clock_known: Annotated[bool, Field(description="False: the file has no time of day; it begins at the upload")]
    duration_s: Annotated[float, Field(description="By the autopilot's clock, where the file has it")]
    clock_jumps: Annotated[
        list[ClockJumpView],
        Field(description="When the clock of the computer that wrote a `.tlog` was set in the middle of it; up to 20"),
    ] = []
    distance_m: Annotated[float, Field(description="Over ground")]
    max_height_m: Annotated[float | None, Field(description="Above home")]
    track: Annotated[list[tuple[float, float]], Field(description="Up to 200 positions, latitude and longitude")]
    frames: int
    skipped_bytes: Annotated[int, Field(description="Of the uploaded file: torn places that could not be read")]
    size_bytes: Annotated[int, Field(description="Of the telemetry log that was made")]
