"""The links: agents, browsers, the UDP endpoint, and the way of a frame between them."""

from typing import Final

from server.http.part import Part
from server.link.api import routes

PART: Final = Part(
    routers=(routes.router,),
)
