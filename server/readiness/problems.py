"""What the refusals of readiness are in HTTP."""

from typing import Final

from server.http.problem_kinds import Kind, Problems
from server.readiness.core.maintenance_refusals import NotYoursToMaintain, TooManyTasks, UnknownTask
from server.readiness.core.refusals import NoSuchKind, NotYourChecklist, PreflightIncomplete, SignsForPilot

PROBLEMS: Final[Problems] = {
    PreflightIncomplete: Kind("preflight-incomplete", 409, "Own lines are not confirmed"),
    SignsForPilot: Kind("signs-for-pilot", 403, "The pilot signs"),
    NotYourChecklist: Kind("not-your-checklist", 403, "Not your checklist"),
    NoSuchKind: Kind("no-such-kind", 404, "No such kind of drone"),
    UnknownTask: Kind("unknown-task", 404, "No such maintenance"),
    NotYoursToMaintain: Kind("not-yours-to-maintain", 403, "Not your drone to maintain"),
    TooManyTasks: Kind("too-many-tasks", 409, "Too much maintenance"),
}
