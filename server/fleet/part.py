"""What the tower takes from this capability."""

from typing import Final

from server.fleet.api import enrolment_routes, loan_routes, restraint_routes, routes, update_routes
from server.http.part import Part

PART: Final = Part(
    routers=(routes.router, enrolment_routes.router, loan_routes.router, restraint_routes.router, update_routes.router),
    tags={"drones": "The squad, and its administration.", "enrolment": "How the agent of a drone makes its key known."},
)
