"""The part of the tower's REST API that `tower connect` needs, on the standard library's client in a thread.

Not httpx, because this runs on users' machines: `httpx.AsyncClient` would add 9.5 MB and 0.11 s of CPU to a start of 25
MB and 0.14 s, for a handful of requests.
"""

import asyncio
import json
import ssl
import urllib.error
import urllib.request
from dataclasses import dataclass
from typing import Any, Final

from connect.tower_url import TowerUrl
from connect.unusable import TowerAway, Unusable

ANSWER_WITHIN_S: Final = 10.0


@dataclass(frozen=True)
class Answer:
    """`body`: the parsed JSON, None if there is none."""

    status: int
    body: Any

    @property
    def done(self) -> bool:
        return 200 <= self.status < 300

    @property
    def code(self) -> str:
        """The problem, for programs."""
        kind = self.body.get("type", "") if isinstance(self.body, dict) else ""
        return str(kind).rpartition("/")[2]

    @property
    def words(self) -> str:
        """The problem, for people."""
        body = self.body if isinstance(self.body, dict) else {}
        return str(body.get("detail") or body.get("title") or f"HTTP status {self.status}")


class Rest:
    """Raises TowerAway if the tower is unreachable, Unusable if it does not accept the token."""

    def __init__(self, tower: TowerUrl, token: str) -> None:
        self._tower = tower
        self._token = token
        proxies = urllib.request.ProxyHandler(None if tower.secure else {})
        self._opener = urllib.request.build_opener(_NoRedirects, proxies)

    async def ask(self, method: str, path: str, body: Any = None, **headers: str) -> Answer:
        """`path` is relative to `/api/v1`."""
        answer = await asyncio.to_thread(self._ask, method, path, body, headers)
        if answer.status == 401:
            raise Unusable(f"{self._tower.origin} refuses: {answer.words}")
        return answer

    def _ask(self, method: str, path: str, body: Any, more: dict[str, str]) -> Answer:
        data = None if body is None else json.dumps(body).encode()
        headers = {"Authorization": f"Bearer {self._token}", "Content-Type": "application/json"} | more
        # The address is known to be http or https (connect.tower_url).
        request = urllib.request.Request(self._tower.api + path, data=data, method=method, headers=headers)  # noqa: S310
        try:
            with self._opener.open(request, timeout=ANSWER_WITHIN_S) as answer:
                return Answer(answer.status, _json(answer.read()))
        except urllib.error.HTTPError as error:
            with error:
                return Answer(error.code, _json(error.read()))
        except urllib.error.URLError as error:
            if isinstance(error.reason, ssl.SSLError):
                raise Unusable(f"{self._tower.origin}: its certificate is not accepted: {error.reason}") from None
            raise TowerAway(f"{self._tower.origin} cannot be reached: {error.reason}") from None
        except (OSError, ValueError) as error:
            raise TowerAway(f"{self._tower.origin} cannot be reached: {error}") from None


class _NoRedirects(urllib.request.HTTPRedirectHandler):
    """The token is only for the named tower, not for a redirect target."""

    def redirect_request(self, *_: object) -> None:
        return None


def _json(data: bytes) -> Any:
    try:
        return json.loads(data) if data else None
    except ValueError:
        return None
