"""A tile server on this machine, which counts what it is asked for and can be cut off."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from worlds.tile_files import one_colour_png


class TileServer:
    """`status`: the answer to all that follows. `slow`: holds answers back until it is set."""

    def __init__(self) -> None:
        self.tile = one_colour_png(30, 160, 60)
        self.status = 200
        self.asked: Counter[str] = Counter()
        self.headers: dict[str, str] = {}
        self.slow = threading.Event()
        self.slow.set()
        self.at_a_time = self.most_at_a_time = 0
        self._lock = threading.Lock()
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                with outer._lock:
                    outer.asked[self.path] += 1
                    outer.headers = dict(self.headers.items())
                    outer.at_a_time += 1
                    outer.most_at_a_time = max(outer.most_at_a_time, outer.at_a_time)
                outer.slow.wait(20)
                with outer._lock:
                    outer.at_a_time -= 1
                self.send_response(outer.status)
                if outer.status in (301, 302):
                    self.send_header("Location", "http://127.0.0.1:1/secret")
                self.send_header("Content-Type", "text/html")
                body = outer.tile if outer.status == 200 else b""
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, format: str, *args: object) -> None:
                pass

        self._http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._thread = threading.Thread(target=self._http.serve_forever, args=(0.02,), daemon=True)
        self._thread.start()

    @property
    def template(self) -> str:
        return f"http://127.0.0.1:{self._http.server_port}/t/{{z}}/{{x}}/{{y}}.png?key=s3cret"

    def cut(self) -> None:
        """Nothing listens there any more."""
        self._http.shutdown()
        self._http.server_close()
        self._thread.join()


@contextmanager
def tile_server() -> Iterator[TileServer]:
    server = TileServer()
    try:
        yield server
    finally:
        server.slow.set()
        server.cut()
