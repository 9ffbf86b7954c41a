"""What the refusals of plans are in HTTP."""

from typing import Final

from server.http.problem_kinds import INVALID, MALFORMED_JSON, TOO_LARGE, Kind, Problems
from server.plans.core.document import DocumentTooLarge
from server.plans.core.ground_check import IntoTheGround
from server.plans.core.plan_body import BadPlan, MalformedBody
from server.plans.core.plans import PlanNotRead
from server.plans.store.library import ChangedMeanwhile, NotYourMission, TooManyMissions, UnknownMission, VersionNeeded

PROBLEMS: Final[Problems] = {
    IntoTheGround: Kind("into-the-ground", 409, "The mission leads into the ground"),
    MalformedBody: MALFORMED_JSON,
    BadPlan: INVALID,
    UnknownMission: Kind("unknown-mission", 404, "No such mission"),
    NotYourMission: Kind("not-your-mission", 403, "Not your mission"),
    TooManyMissions: Kind("too-many-missions", 409, "Too many missions"),
    ChangedMeanwhile: Kind("changed-meanwhile", 412, "Changed meanwhile"),
    VersionNeeded: Kind("version-needed", 428, "Say which version"),
    DocumentTooLarge: TOO_LARGE,
    PlanNotRead: Kind("plan-not-read", 409, "The plan could not be read"),
}
