"""The index of open browsers by user follows the browsers that come and go."""

from types import SimpleNamespace
from typing import Any

import pytest

from server.live import open_browsers
from server.live.open_browsers import OpenBrowsers
from wire.ids import UserId


class Browser(SimpleNamespace):
    """Only whose it is."""


def test_the_index_follows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(open_browsers, "Browser", Browser)
    browsers = OpenBrowsers()
    made: list[Any] = [Browser(viewer=SimpleNamespace(user_id=UserId(user))) for user in (1, 1, 2)]
    for number, one in enumerate(made):
        browsers[number] = one
    assert list(browsers.of_user(UserId(1))) == made[:2]
    assert browsers.pop(0) is made[0]
    assert list(browsers.of_user(UserId(1))) == [made[1]]
    assert browsers.pop(0, None) is None
    browsers.pop(1)
    assert list(browsers.of_user(UserId(1))) == []
    assert list(browsers.of_user(UserId(2))) == [made[2]]
