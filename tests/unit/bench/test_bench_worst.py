"""The worst bodies are as large as a schema and the tower let them be, and every route has some."""

from __future__ import annotations

import json
from typing import Any, Final

import pytest

from bench.worst.bodies import WorstBodies
from bench.worst.cases import without_case

MOST: Final = 5_000
COMPONENTS: Final[dict[str, Any]] = {"Place": {"type": "array", "items": {"type": "number"}, "maxItems": 2}}


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


@pytest.mark.parametrize(
    ("schema", "largest"),
    [
        (_object(name={"type": "string", "maxLength": 64}), {"name": "x" * 64}),
        (_object(kind={"enum": ["a", "longer"]}), {"kind": "longer"}),
        (_object(count={"type": "integer", "maximum": 9}), {"count": 9}),
        (_object(of={"anyOf": [{"type": "null"}, {"type": "boolean"}]}), {"of": False}),
        (_object(at={"$ref": "#/components/schemas/Place"}), {"at": [0.123456789] * 2}),
    ],
)
def test_what_has_a_limit_is_at_it(schema: dict[str, Any], largest: Any) -> None:
    assert json.loads(WorstBodies(COMPONENTS, MOST).of(schema)) == largest


@pytest.mark.parametrize(
    "schema",
    [
        _object(text={"type": "string"}),
        _object(places={"type": "array", "items": {"$ref": "#/components/schemas/Place"}}, name={"type": "string"}),
        {"type": "object", "additionalProperties": True},
    ],
)
def test_what_has_no_limit_fills_the_body(schema: dict[str, Any]) -> None:
    body = WorstBodies(COMPONENTS, MOST).of(schema)
    assert MOST / 4 < len(body) <= MOST
    json.loads(body)


def test_wrong_bodies_are_as_large_as_they_may_be() -> None:
    schema = _object(places={"type": "array", "items": {"$ref": "#/components/schemas/Place"}})
    wrong = dict(WorstBodies(COMPONENTS, MOST).wrong(schema))
    assert set(wrong) == {"deep", "a long number", "many keys", "many escapes", "places: wrong items"}
    assert all(MOST - 100 < len(body) <= MOST for body in wrong.values())


def test_a_route_without_a_worst_case_is_named() -> None:
    body = {"content": {"image/tiff": {}}}
    document = {"paths": {"/ships/{ship_id}": {"put": {"operationId": "put_ship", "requestBody": body}}}}
    words = "\n".join(without_case(document))
    assert "put_ship: no value for {ship_id}" in words
    assert "put_ship: a body of image/tiff needs a worst one" in words
    assert "put_plan: bench/worst/named.py has it, and the API does not" in words
