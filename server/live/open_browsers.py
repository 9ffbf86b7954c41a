"""The open browsers by their number, with an index by user: a thousand may leave in one round of the loop."""

from collections.abc import Iterable
from typing import Any

from server.live.browser import Browser
from wire.ids import UserId


class OpenBrowsers(dict[int, Browser]):
    """Change it by item assignment and `pop` alone: the index follows only these."""

    def __init__(self) -> None:
        super().__init__()
        self._of_user: dict[UserId, dict[int, Browser]] = {}

    def of_user(self, user_id: UserId) -> Iterable[Browser]:
        """Those of one user."""
        return self._of_user.get(user_id, {}).values()

    def __setitem__(self, number: int, browser: Browser) -> None:
        super().__setitem__(number, browser)
        self._of_user.setdefault(browser.viewer.user_id, {})[number] = browser

    def pop(self, number: int, *default: Any) -> Any:
        browser = super().pop(number, *default)
        if isinstance(browser, Browser):
            own = self._of_user[browser.viewer.user_id]
            del own[number]
            if not own:
                del self._of_user[browser.viewer.user_id]
        return browser
