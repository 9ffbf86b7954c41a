"""The firmware that AUTOPILOT_VERSION names."""

from __future__ import annotations

import pytest

from wire.autopilots.registry import FAMILIES
from wire.dialect import mavlink
from wire.firmware import Release, firmware_words, release_of


def version(major: int, minor: int, patch: int, kind: int) -> int:
    return major << 24 | minor << 16 | patch << 8 | kind


@pytest.mark.parametrize(
    ("number", "words", "release"),
    [
        (0, "", None),
        (version(4, 6, 2, 255), "4.6.2", (4, 6)),
        (version(4, 6, 0, 192), "4.6.0-rc", (4, 6)),
        (version(4, 6, 0, 128), "4.6.0-beta", (4, 6)),
        (version(4, 7, 0, 64), "4.7.0-alpha", (4, 6)),
        (version(4, 7, 0, 0), "4.7.0-dev", (4, 6)),
        (version(5, 0, 0, 0), "5.0.0-dev", (4, 99)),
        (version(1, 16, 1, 255), "1.16.1", (1, 16)),
    ],
)
def test_a_release_and_its_words(number: int, words: str, release: Release | None) -> None:
    assert firmware_words(number) == words
    assert release_of(number) == release


def test_a_build_some_commits_after_a_release_has_what_that_has() -> None:
    assert FAMILIES[mavlink.MAV_AUTOPILOT_PX4].release_of(version(1, 16, 0, 0)) == (1, 16)
    assert FAMILIES[mavlink.MAV_AUTOPILOT_PX4].release_of(version(1, 17, 0, 64)) == (1, 16)
    assert FAMILIES[mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA].release_of(version(4, 7, 0, 0)) == (4, 6)
