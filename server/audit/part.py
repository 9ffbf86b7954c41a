"""The audit trail: who did what, in a chain that shows changes."""

from typing import Final

from server.audit.api import router
from server.http.part import Part

PART: Final = Part(
    routers=(router,),
    tags={"audit": "Who did what, for admins."},
)
