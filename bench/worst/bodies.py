"""The worst JSON that a schema allows, and JSON that is wrong in every way that is dear to read."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, Final

Schema = Mapping[str, Any]
_DEEPEST: Final = 12
_KEY: Final = '"key_12345": '
_ANY: Final[Schema] = {"type": "integer"}
"""For what may be anything: the shortest values make the most of them."""
_BY_FORMAT: Final = {"date-time": "2030-01-01T00:00:00Z", "date": "2030-01-01", "uuid": "0" * 32}


class WorstBodies:
    """For one document of schemas. `components`: what `$ref` names; `most_bytes`: of a body."""

    def __init__(self, components: Mapping[str, Schema], most_bytes: int) -> None:
        self._components = components
        self._most_bytes = most_bytes

    def of(self, schema: Schema) -> bytes:
        """The largest valid body: every text, list and number at its limit; what has no limit fills the body."""
        room = self._most_bytes
        while len(body := _encoded(self._value(schema, room, 0))) > self._most_bytes and room > 1:
            room //= 2
        return body

    def wrong(self, schema: Schema) -> Iterator[tuple[str, bytes]]:
        """Bodies that must be refused, with a name for each."""
        most = self._most_bytes
        yield "deep", b"[" * (most // 2) + b"]" * (most // 2)
        yield "a long number", b'{"a": ' + b"9" * (most - 8) + b"}"
        yield "many keys", _filled('"k%d":0', most, "{", "}")
        yield "many escapes", b'{"a": "' + b"\\u0000" * ((most - 10) // 6) + b'"}'
        for name, of in self._properties(schema).items():
            if "array" in _types(of):
                yield f"{name}: wrong items", b'{"%s":[%s]}' % (name.encode(), b",".join([b"{}"] * (most // 3 - 9)))

    def _properties(self, schema: Schema) -> dict[str, Schema]:
        found: dict[str, Schema] = {}
        for one in self._choices(schema):
            found |= {name: self._resolved(of) for name, of in one.get("properties", {}).items()}
        return found

    def _resolved(self, schema: Schema) -> Schema:
        while "$ref" in schema:
            schema = self._components[schema["$ref"].rpartition("/")[2]]
        return schema

    def _choices(self, schema: Schema) -> list[Schema]:
        schema = self._resolved(schema)
        for name in ("anyOf", "oneOf"):
            if name in schema:
                return [one for choice in schema[name] for one in self._choices(choice)]
        return [schema]

    def _value(self, schema: Schema, room: int, depth: int) -> Any:
        values = [self._one(choice, room, depth) for choice in self._choices(schema)]
        return max(values, key=lambda value: len(_encoded(value)))

    def _one(self, schema: Schema, room: int, depth: int) -> Any:
        if "const" in schema:
            return schema["const"]
        if "enum" in schema:
            return max(schema["enum"], key=lambda value: len(str(value)))
        match _types(schema)[0]:
            case "object":
                return self._object(schema, room, depth)
            case "array":
                return self._array(schema, room, depth)
            case "string":
                if schema.get("format") in _BY_FORMAT:
                    return _BY_FORMAT[schema["format"]]
                return "x" * min(schema.get("maxLength", room), room)
            case "integer" | "number" as kind:
                highest = schema.get("maximum", schema.get("exclusiveMaximum", 2**31 - 1))
                return int(highest) if kind == "integer" else 0.123456789 if highest > 1 else highest
            case "boolean":
                return False
        return None

    def _object(self, schema: Schema, room: int, depth: int) -> Any:
        if depth > _DEEPEST:
            return {}
        properties = schema.get("properties", {})
        share = room // max(1, len(properties))
        found = {name: self._value(of, share, depth + 1) for name, of in properties.items()}
        more = schema.get("additionalProperties", False)
        if more is not False:
            of = more if isinstance(more, Mapping) else _ANY
            value = self._value(of, 1, depth + 1)
            count = room // (len(_encoded(value)) + len(_KEY))
            found |= {f"key_{n:05}": value for n in range(min(count, schema.get("maxProperties", count)))}
        return found

    def _array(self, schema: Schema, room: int, depth: int) -> Any:
        if depth > _DEEPEST:
            return []
        if "prefixItems" in schema:
            return [self._value(of, room, depth + 1) for of in schema["prefixItems"]]
        value = self._value(schema.get("items", _ANY), 64, depth + 1)
        return [value] * min(schema.get("maxItems", room), max(1, room // (len(_encoded(value)) + 1)))


def _types(schema: Schema) -> list[str]:
    of = schema.get("type", "object" if "properties" in schema else "null")
    return [of] if isinstance(of, str) else list(of)


def _encoded(value: Any) -> bytes:
    return json.dumps(value, separators=(",", ":")).encode()


def _filled(part: str, most: int, begin: str, end: str) -> bytes:
    """`part` with a number, with commas between, until the text has `most` bytes."""
    parts: list[str] = []
    size = 2
    while size + len(part) + 8 < most:
        parts.append(part % len(parts))
        size += len(parts[-1]) + 1
    return (begin + ",".join(parts) + end).encode()
