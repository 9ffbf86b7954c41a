"""What the refusals of teams are in HTTP."""

from typing import Final

from server.http.problem_kinds import Kind, Problems
from server.teams.core import (
    DroneInUse,
    InAnotherTeam,
    LastTeamAdmin,
    MemberAlready,
    NotYourDrone,
    TeamAdminsOnly,
    TeamFull,
    TooManyTeams,
    UnknownInvitation,
    UnknownTeam,
)

PROBLEMS: Final[Problems] = {
    UnknownTeam: Kind("unknown-team", 404, "No such team"),
    UnknownInvitation: Kind("unknown-invitation", 404, "No such invitation"),
    TeamAdminsOnly: Kind("team-admins-only", 403, "For admins of the team"),
    NotYourDrone: Kind("not-your-drone", 403, "Not your drone"),
    InAnotherTeam: Kind("in-another-team", 409, "The drone is in another team"),
    DroneInUse: Kind("drone-in-use", 409, "Somebody flies the drone"),
    LastTeamAdmin: Kind("last-team-admin", 409, "The last team admin must stay"),
    MemberAlready: Kind("member-already", 409, "In the team already"),
    TooManyTeams: Kind("too-many-teams", 409, "Too many teams"),
    TeamFull: Kind("team-full", 409, "The team is full"),
}
