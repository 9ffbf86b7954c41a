"""What the tower takes from this capability."""

from typing import Final

from server.airspace.api import router
from server.http.part import Part

PART: Final = Part(
    routers=(router,),
    tags={"zones": "Where drones may not be, not above a height, or only."},
)
