"""Every route of the REST API with its worst requests. `python -m bench.worst.cases` fails for a route without."""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from bench.worst.bodies import WorstBodies
from bench.worst.named import LAST, NAMED, PATHS, PATHS_OF
from server.app.composition import create_app
from server.app.tower import TowerApp
from server.http.body import bounds
from server.runtime.settings import Settings

_JSON: Final = "application/json"


@dataclass(frozen=True)
class Case:
    """`bodies`: by name; None: the request has none."""

    name: str
    method: str
    path: str
    query: dict[str, str]
    content_type: str
    bodies: dict[str, bytes | None]


def cases_of(app: TowerApp) -> list[Case]:
    """In an order in which what is deleted is deleted last. Raises KeyError for a value of a path without example."""
    document = app.openapi()
    found = list(_cases(document))
    order = {"GET": 0, "POST": 1, "PUT": 1, "PATCH": 1, "DELETE": 2}
    return sorted(found, key=lambda case: (case.name in LAST, order[case.method], case.name))


def _cases(document: Mapping[str, Any]) -> Iterator[Case]:
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            name = operation["operationId"]
            filled = re.sub(r"\{(\w+)\}", lambda found: (PATHS | PATHS_OF.get(name, {}))[found[1]], path)  # noqa: B023
            content = operation.get("requestBody", {}).get("content", {})
            content_type = next(iter(content), "")
            bodies: dict[str, bytes | None] = dict(NAMED[name]()) if name in NAMED else {}
            if content_type == _JSON:
                most, _ = bounds(filled)
                make = WorstBodies(document["components"]["schemas"], most)
                schema = content[_JSON]["schema"]
                bodies |= {"largest": make.of(schema), **dict(make.wrong(schema))}
            query = dict(_query(operation.get("parameters", [])))
            yield Case(name, method.upper(), filled, query, content_type, bodies or {"no body": None})


def _query(parameters: list[dict[str, Any]]) -> Iterator[tuple[str, str]]:
    """The largest page, everybody's, and nothing that would make the answer smaller."""
    for one in parameters:
        if one["in"] == "query" and (one.get("required") or one["name"] in ("limit", "cell_m", "everybody")):
            schema = one["schema"]
            least = one["name"] == "cell_m"
            value = schema.get("minimum" if least else "maximum", "true" if schema.get("type") == "boolean" else "x")
            yield one["name"], str(value)


def without_case(document: Mapping[str, Any]) -> list[str]:
    """What is missing, in words."""
    wrong = []
    for path, operations in document["paths"].items():
        for operation in operations.values():
            name = operation["operationId"]
            missing = set(re.findall(r"\{(\w+)\}", path)) - set(PATHS) - set(PATHS_OF.get(name, {}))
            wrong += [f"{name}: no value for {{{one}}} in bench/worst/named.py" for one in sorted(missing)]
            content = operation.get("requestBody", {}).get("content", {})
            if content and _JSON not in content and name not in NAMED:
                wrong.append(f"{name}: a body of {next(iter(content))} needs a worst one in bench/worst/named.py")
    known = {one["operationId"] for operations in document["paths"].values() for one in operations.values()}
    wrong += [f"{name}: bench/worst/named.py has it, and the API does not" for name in sorted(
        (set(NAMED) | set(PATHS_OF) | set(LAST)) - known)]  # fmt: skip
    return wrong


def main() -> int:
    with tempfile.TemporaryDirectory() as place:
        app = create_app(Settings(var=Path(place), web=Path(place)))
        wrong = without_case(app.openapi())
    print(*wrong, sep="\n", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
