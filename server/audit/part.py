"""What the tower takes from this capability."""

from typing import Final

from server.audit.api import router
from server.http.part import Part

PART: Final = Part(
    routers=(router,),
    tags={"audit": "Who did what, for admins."},
)
