"""What the tower takes from this capability."""

from typing import Final

from server.http.part import Part
from server.identification.api import router

PART: Final = Part(
    routers=(router,),
)
