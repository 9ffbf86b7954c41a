"""What the refusals that belong to no capability are in HTTP."""

from typing import Final

from server.http.private_path import NotPrivate
from server.http.problem_kinds import INVALID, Kind, Problems
from server.http.request_shares import TooManyRequests
from server.kernel.access import (
    AdminsOnly,
    BadToken,
    InPersonOnly,
    NotSignedIn,
    PasswordChangeNeeded,
    ProofNeeded,
    ReadOnlyAccount,
    ScopeMissing,
    SecondFactorDemanded,
    SessionExpired,
    UnknownDrone,
)
from server.kernel.drone_settings import BadDroneSettings
from server.kernel.names import BadName
from server.kernel.shares import BadShareLimit
from server.kernel.tower_refusals import LastTower, TowerDraining, UnknownTower
from server.runtime.side_thread import TooMuchWork

PROBLEMS: Final[Problems] = {
    NotSignedIn: Kind("not-signed-in", 401, "Not signed in"),
    SessionExpired: Kind("session-expired", 401, "The session has ended"),
    BadToken: Kind("bad-token", 401, "The token is not valid"),
    ScopeMissing: Kind("scope-missing", 403, "The token lacks the scope"),
    PasswordChangeNeeded: Kind("password-change-needed", 403, "The first password must be changed"),
    SecondFactorDemanded: Kind("second-factor-demanded", 403, "A second factor must be set up"),
    InPersonOnly: Kind("in-person-only", 403, "Not with a token"),
    ProofNeeded: Kind("proof-needed", 403, "Confirm that it is you"),
    TooManyRequests: Kind("too-many-requests", 429, "Too many requests"),
    TooMuchWork: Kind("too-much-work", 429, "Too much at once"),
    ReadOnlyAccount: Kind("read-only-account", 403, "Your account only watches"),
    AdminsOnly: Kind("admins-only", 403, "For admins only"),
    UnknownTower: Kind("unknown-tower", 404, "No such tower"),
    LastTower: Kind("last-tower", 409, "No other tower"),
    TowerDraining: Kind("tower-draining", 503, "The tower ends its work"),
    UnknownDrone: Kind("unknown-drone", 404, "No such drone"),
    NotPrivate: Kind("https-only", 403, "Not over plain http"),
    BadShareLimit: INVALID.at("limit"),
    BadDroneSettings: INVALID.at("lost_action_s"),
    BadName: INVALID.at("name"),
}
