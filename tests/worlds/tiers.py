"""How much a property test tries in each tier of the tests (README.md of the tests)."""

from collections.abc import Iterable
from typing import Any

import pytest
from hypothesis import settings

COMMIT = "commit"
LONG = "long"


def register_tiers() -> None:
    """Makes the two profiles of Hypothesis; `--hypothesis-profile=long` chooses the other one."""
    # How long an example takes says something of the machine and nothing of us.
    settings.register_profile(COMMIT, settings(), deadline=None, max_examples=40)
    settings.register_profile(LONG, settings(), deadline=None, max_examples=400)
    settings.load_profile(COMMIT)


def is_long() -> bool:
    return settings.get_current_profile_name() == LONG


def examples(commit: int, *, long: int) -> int:
    """Returns how many examples a test tries whose examples are dearer, or need to be more, than others'."""
    return long if is_long() else commit


def thinned(cases: Iterable[tuple[Any, ...]], *, every: int, why: str) -> list[Any]:
    """Returns cases for `pytest.mark.parametrize`: each `every`-th, from the first, is of the short tier, and the rest
    wait for the long one. Of a product, `every` has no divisor in common with the last factor's length, or the same
    values of it would stay each time."""
    return [
        pytest.param(*case, marks=() if number % every == 0 else pytest.mark.long(why))
        for number, case in enumerate(cases)
    ]
