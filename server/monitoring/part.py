"""What the tower counts and traces: Prometheus, OpenTelemetry."""

from typing import Final

from server.http.part import Part
from server.monitoring.api import routes

PART: Final = Part(
    routers=(routes.router,),
    tags={"metrics": "What the tower counts, for Prometheus."},
)
