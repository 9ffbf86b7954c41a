"""Teams: people and drones that belong together."""

from typing import Final

from server.http.part import Part
from server.teams.api import router

PART: Final = Part(
    routers=(router,),
    tags={"teams": "People and drones that belong together."},
)
