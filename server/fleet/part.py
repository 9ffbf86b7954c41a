"""Drones: the squad, enrolment, loans, updates of their agents."""

from collections.abc import Iterable
from typing import Final

from server.fleet.api import enrolment_routes, loan_routes, restraint_routes, routes, update_routes
from server.fleet.io.agent_packages import AgentPackages
from server.http.part import Common, Part


def _services(common: Common) -> Iterable[object]:
    return (AgentPackages(common.settings.agent_releases),)


PART: Final = Part(
    routers=(routes.router, enrolment_routes.router, loan_routes.router, restraint_routes.router, update_routes.router),
    tags={"drones": "The squad, and its administration.", "enrolment": "How the agent of a drone makes its key known."},
    services=_services,
)
