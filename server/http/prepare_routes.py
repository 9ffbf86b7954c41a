"""Makes the routes ready before the tower listens."""

from fastapi import FastAPI


def prepare_routes(app: FastAPI) -> None:
    """Does what FastAPI otherwise does at the first request, where it blocks everything for half a second."""
    if app.middleware_stack is None:
        app.middleware_stack = app.build_middleware_stack()
    scope = {"type": "http", "method": "GET", "path": "/", "root_path": "", "query_string": b"", "headers": []}
    for route in app.router.routes:
        route.matches(dict(scope, app=app))
