"""`/api/v1/flights/{id}/identification`: how fast the drone did what its sticks said, from the recorded flight."""

from __future__ import annotations

import asyncio
from typing import Annotated, Literal

from fastapi import APIRouter, Path
from pydantic import BaseModel, Field

from server.flights.api.readable import known_flight
from server.flights.core.refusals import FlightElsewhere, FlightRunning, NotIdentified, UnknownFlight
from server.flights.store import catalogue
from server.flights.store.files import TLOG
from server.http.access import Viewer
from server.http.dependencies import DatabaseDep, FlightsDep, HubDep
from server.http.problem_docs import answers
from server.identification.store.running import run_identification
from server.kernel.access import NotSignedIn, SessionExpired

router = APIRouter(prefix="/api/v1/flights", tags=["flights"], responses=answers(NotSignedIn, SessionExpired))


class FirstOrderView(BaseModel):
    """First order plus delay: `gain / (1 + tau s) * exp(-delay s)`."""

    gain: Annotated[float, Field(description="For full deflection, in the unit of the axis")]
    tau_s: Annotated[float, Field(description="Time constant")]
    delay_s: Annotated[float, Field(description="With that of the link in both directions")]
    rise_s: Annotated[float, Field(description="From 10 % to 90 % of a step")]
    r_squared: Annotated[float, Field(description="Part of the variance that the model explains, at most 1")]
    manoeuvres: Annotated[int, Field(description="That were fitted together")]
    sample_s: Annotated[float, Field(description="Between two attitudes; nothing shorter can be told")]
    at_bound: Annotated[bool, Field(description="Time constant or delay is at the end of what was searched")]
    residual_correlation: Annotated[
        float, Field(description="Of what the model leaves with itself a sample later; about 0 is noise")
    ]
    is_patterned: Annotated[
        bool, Field(description="What the model leaves is no noise: a higher order, or something else moved the drone")
    ]


class TraceView(BaseModel):
    """One manoeuvre: what the stick and the drone did, and what the model says. Lists of the same length."""

    began_s: Annotated[float, Field(description="Seconds since 1970")]
    times_s: Annotated[list[float], Field(description="Since then")]
    given: Annotated[list[float], Field(description="Deflection of the stick, -1 to 1")]
    got: Annotated[list[float], Field(description="What the drone did, in the unit of the axis")]
    model: Annotated[list[float], Field(description="What the fitted model does")]


class AxisView(BaseModel):
    """One axis; `fit` null: its stick made no manoeuvre that could be fitted."""

    axis: Literal["roll", "pitch", "yaw", "climb"]
    unit: str
    fit: FirstOrderView | None
    traces: Annotated[list[TraceView], Field(description="At most six manoeuvres, those with the greatest deflection")]


class IdentificationView(BaseModel):
    axes: list[AxisView]


@router.get(
    "/{flight_id}/identification", responses=answers(UnknownFlight, FlightRunning, FlightElsewhere, NotIdentified)
)
async def identify_flight(
    principal: Viewer,
    hub: HubDep,
    database: DatabaseDep,
    flights: FlightsDep,
    flight_id: Annotated[int, Path(ge=1, le=2**31 - 1)],
) -> IdentificationView:
    """Fits step responses of roll, pitch, yaw and climb to the sticks of the flight (docs/statistics.md)."""
    row, _ = await known_flight(hub, database, principal, flight_id)
    if row.state == catalogue.RUNNING:
        raise FlightRunning
    if row.store != flights.files.id:
        raise FlightElsewhere
    path = flights.files.path(row.drone_id, row.file, TLOG)
    if not await asyncio.to_thread(path.is_file):
        raise UnknownFlight
    async with flights.export_turns:
        return IdentificationView.model_validate({"axes": await run_identification(path)})
