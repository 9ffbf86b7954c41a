"""What is wrong with a field of a request, in our words: a table of pydantic's types of errors.

The console translates these texts (docs/languages.md). None repeats what was sent: it may be a password.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from server.kernel.bad_field import BadField

FIELD_ERRORS: Final[Mapping[str, str]] = {
    "missing": "this is needed",
    "extra_forbidden": "no such field is known here",
    "bool_type": "must be true or false",
    "bool_parsing": "must be true or false",
    "int_type": "must be a whole number",
    "int_parsing": "must be a whole number",
    "int_from_float": "must be a whole number",
    "int_parsing_size": "this number is too large",
    "float_type": "must be a number",
    "float_parsing": "must be a number",
    "finite_number": "must be a finite number",
    "greater_than": "must be more than {limit}",
    "greater_than_equal": "must be {limit} at least",
    "less_than": "must be less than {limit}",
    "less_than_equal": "must be {limit} at most",
    "string_type": "must be a text",
    "string_unicode": "must be a text of valid characters",
    "string_too_short": "is too short: its length must be {limit} at least",
    "string_too_long": "is too long: its length must be {limit} at most",
    "string_pattern_mismatch": "is not written as it must be",
    "list_type": "must be a list",
    "tuple_type": "must be a list",
    "too_short": "has too few entries: it needs {limit} at least",
    "too_long": "has too many entries: it may have {limit} at most",
    "dict_type": "must be a JSON object",
    "model_type": "must be a JSON object",
    "model_attributes_type": "must be a JSON object",
    "enum": "must be one of: {choices}",
    "literal_error": "must be one of: {choices}",
    "union_tag_invalid": "must be one of: {choices}",
    "union_tag_not_found": "lacks the field that says which kind it is",
    "datetime_type": "must be a date with a time, such as 2027-01-31T12:00:00Z",
    "datetime_parsing": "must be a date with a time, such as 2027-01-31T12:00:00Z",
    "datetime_from_date_parsing": "must be a date with a time, such as 2027-01-31T12:00:00Z",
    "timezone_aware": "needs a time zone, such as the Z of 2027-01-31T12:00:00Z",
}
OTHER: Final = "this is not valid here"
"""For types without a row, and for errors of libraries."""
_LIMITS: Final = ("gt", "ge", "lt", "le", "min_length", "max_length")
_CHOICES: Final = ("expected", "expected_tags")


def field_error(error: Mapping[str, Any]) -> str:
    """The text for one of the `errors()` of a pydantic error."""
    context: Mapping[str, Any] = error.get("ctx") or {}
    fault = context.get("error")
    if isinstance(fault, BadField):
        return str(fault)
    holes = {"limit": _named(context, _LIMITS), "choices": _named(context, _CHOICES)}
    return FIELD_ERRORS.get(error["type"], OTHER).format_map(holes)


def _named(context: Mapping[str, Any], names: tuple[str, ...]) -> str:
    """A limit without needless decimals, or choices without quotes and an English `or`."""
    value = next((context[name] for name in names if name in context), "")
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    return str(value).replace(" or ", ", ").replace("'", "")
