"""What the refusals of control are in HTTP."""

from typing import Final

from server.control.store.service import ControlRefused
from server.http.problem_kinds import Kind, Problems

PROBLEMS: Final[Problems] = {
    ControlRefused: Kind("control-refused", 409, "The controls did not change"),
}
