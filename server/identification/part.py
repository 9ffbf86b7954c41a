"""System identification: a model of a drone from its recorded flight."""

from typing import Final

from server.http.part import Part
from server.identification.api import router

PART: Final = Part(
    routers=(router,),
)
