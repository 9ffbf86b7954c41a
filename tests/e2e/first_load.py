"""The cost of a first visit to the console: bytes received, and time until something meaningful is visible."""

from dataclasses import dataclass
from typing import Any, Final

from playwright.sync_api import Browser, Request

FOUR_G: Final = {"offline": False, "latency": 170, "downloadThroughput": 9e6 / 8, "uploadThroughput": 1.5e6 / 8}
"""9 Mbit/s down, 1.5 Mbit/s up, 170 ms before each response, as in DevTools' "Fast 4G"."""

WATCH: Final = """(selector) => {
  const look = () => {
    const part = document.querySelector(selector);
    if (!part || part.getClientRects().length === 0) return;
    watch.disconnect();
    // The frame after the one that draws it.
    requestAnimationFrame(() => requestAnimationFrame((now) => {
      document.documentElement.dataset.meaningfulMs = now;
    }));
  };
  const watch = new MutationObserver(look);
  watch.observe(document, { childList: true, subtree: true });
}"""

CONTENTFUL: Final = """() => new Promise((resolve) => {
  const tell = (list) => {
    const paint = list.getEntriesByName('first-contentful-paint')[0];
    if (paint) resolve(paint.startTime);
  };
  new PerformanceObserver(tell).observe({ type: 'paint', buffered: true });
})"""


@dataclass(frozen=True)
class FirstLoad:
    """Times from the start of the navigation. `bytes_by_path`: bodies and headers, as received."""

    contentful_ms: float
    meaningful_ms: float
    bytes_by_path: dict[str, int]

    @property
    def transferred(self) -> int:
        return sum(self.bytes_by_path.values())

    def transferred_of(self, part: str) -> int:
        return sum(size for path, size in self.bytes_by_path.items() if part in path)


def first_load(
    browser: Browser, address: str, meaningful: str, *, signed_in: Any = None, network: Any = None
) -> FirstLoad:
    """Opens a page in a fresh browser, and waits until `meaningful` (a selector) is visible and nothing more is
    fetched. `signed_in`: a storage state; without it nobody is signed in. Does not count what the service worker
    fetches afterwards for offline use.
    """
    context = browser.new_context(viewport={"width": 1280, "height": 800}, storage_state=signed_in)
    page = context.new_page()
    came: list[Request] = []
    page.on("requestfinished", lambda request: came.append(request))
    session = context.new_cdp_session(page)
    session.send("Network.enable")
    if network is not None:
        session.send("Network.emulateNetworkConditions", network)
    page.add_init_script(f"({WATCH})({meaningful!r})")
    page.goto(address)
    page.locator("html[data-meaningful-ms]").wait_for(state="attached", timeout=60_000)
    page.wait_for_load_state("networkidle")
    contentful_ms = page.evaluate(CONTENTFUL)
    meaningful_ms = float(page.evaluate("document.documentElement.dataset.meaningfulMs"))
    sizes: dict[str, int] = {}
    for request in came:
        size = request.sizes()
        path = request.url.removeprefix(address)
        sizes[path] = sizes.get(path, 0) + size["responseBodySize"] + size["responseHeadersSize"]
    context.close()
    # The paint is presented slightly after the frame that drew it.
    return FirstLoad(contentful_ms, max(meaningful_ms, contentful_ms), sizes)
