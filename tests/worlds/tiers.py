"""How much a property test tries in each tier of the tests (README.md of the tests)."""

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
