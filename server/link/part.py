"""What the tower takes from this capability."""

from typing import Final

from server.http.part import Part
from server.link.api import routes

PART: Final = Part(
    routers=(routes.router,),
)
