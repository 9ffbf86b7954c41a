"""What every refusal is in HTTP: the rows of all capabilities. To add one, add a line to `problems.py` beside it."""

from collections.abc import Iterator
from typing import Final

from server.http import general_problems
from server.http.problem_kinds import Problems
from server.runtime.capabilities import in_every_capability


def _rows() -> Iterator[Problems]:
    yield general_problems.PROBLEMS
    for module in in_every_capability("problems"):
        yield module.PROBLEMS


PROBLEMS: Final[Problems] = {refusal: kind for rows in _rows() for refusal, kind in rows.items()}
