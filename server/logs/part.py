"""Logs of autopilots, fetched from drones."""

from typing import Final

from server.http.part import Part
from server.logs.api import router

PART: Final = Part(
    routers=(router,),
    tags={"logs": "Flight logs, on board and fetched."},
)
