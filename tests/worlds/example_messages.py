"""Examples of every message of a union of msgspec structs: each field once with each kind of value that it may have.

They come from the types, so that a new field, or a new value of an enumeration, has its examples by itself.
"""

import base64
from collections.abc import Iterator
from typing import Any

from msgspec import inspect


def examples(kind: Any) -> Iterator[dict[str, Any]]:
    """Yields the messages as JSON's objects."""
    yield from _of(inspect.type_info(kind))


def _of(kind: inspect.Type) -> list[Any]:
    match kind:
        case inspect.StructType():
            return list(_structs(kind))
        case inspect.UnionType():
            return [one for part in kind.types for one in _of(part)]
        case inspect.Metadata():
            return _of(kind.type)
        case inspect.EnumType():
            return [one.value for one in kind.cls]
        case inspect.LiteralType():
            return list(kind.values)
        case inspect.BoolType():
            return [True, False]
        case inspect.IntType():
            return [one for one in (kind.ge or 0, kind.le) if one is not None]
        case inspect.FloatType():
            return [one for one in (kind.ge, kind.le) if one is not None] or [1.5]
        case inspect.StrType():
            return ["a" * max(1, kind.min_length or 0), *(["a" * kind.max_length] if kind.max_length else [])]
        case inspect.BytesType():
            return [base64.b64encode(bytes(32)).decode()]
        case inspect.NoneType():
            return [None]
        case inspect.TupleType():
            return [[_of(one)[0] for one in kind.item_types]]
        case inspect.VarTupleType() | inspect.ListType():
            fewest = kind.min_length or 0
            return [_of(kind.item_type)[:1] * fewest, *([one] * max(fewest, 1) for one in _of(kind.item_type))]
        case inspect.DictType():
            return [{}, {_of(kind.key_type)[0]: _of(kind.value_type)[0]}]
    raise AssertionError(f"no examples of {kind}")


def _structs(kind: inspect.StructType) -> Iterator[Any]:
    values = {one.encode_name: _of(one.type) for one in kind.fields}
    first = {name: found[0] for name, found in values.items()}
    for name, found in [("", [None]), *values.items()]:
        for value in found:
            fields = {**first, **({name: value} if name else {})}
            if kind.array_like:
                yield list(fields.values())
            else:
                yield fields | ({kind.tag_field: kind.tag} if kind.tag_field else {})
