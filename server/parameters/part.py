"""Parameters of autopilots."""

from typing import Final

from server.http.part import Part
from server.parameters.api import router

PART: Final = Part(
    routers=(router,),
    tags={"parameters": "The parameters of a drone's autopilot."},
)
