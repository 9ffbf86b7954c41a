"""What the refusals of logs are in HTTP."""

from typing import Final

from server.http.problem_kinds import Kind, Problems
from server.logs.core import BadCredential, FileIncomplete, FileNotTaken, NotAskedFor, UnknownLog

PROBLEMS: Final[Problems] = {
    UnknownLog: Kind("unknown-log", 404, "No such log here"),
    BadCredential: Kind("bad-credential", 401, "The ticket or credential is not valid"),
    NotAskedFor: Kind("not-asked-for", 404, "Nobody is waiting for it"),
    FileNotTaken: Kind("no-room", 413, "The file is refused"),
    FileIncomplete: Kind("incomplete", 400, "The file is incomplete"),
}
