"""What the refusals of link are in HTTP."""

from typing import Final

from server.http.problem_kinds import Kind, Problems
from server.link.core.restraint import LosesItsLink

PROBLEMS: Final[Problems] = {
    LosesItsLink: Kind("loses-its-link", 409, "The drone would lose its link"),
}
