"""Live video and its recordings."""

from typing import Final

from server.http.part import Part
from server.video.api import recording_routes, routes

PART: Final = Part(
    routers=(recording_routes.router, routes.router),
    tags={"video": "How it is with the video of a drone.", "recordings": "Recorded video."},
)
