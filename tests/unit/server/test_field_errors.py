"""Wrong fields of requests: each error that the models of the interface can raise has a text of our own."""

import math
from collections.abc import Iterator
from typing import Any, Final, get_args

import pytest
from fastapi._compat import ModelField
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute
from pydantic import BaseModel, ValidationError

from server.app.routers import ROUTERS
from server.control.api.settings_routes import DroneSettingsPatch
from server.http.field_errors import FIELD_ERRORS, OTHER, field_error
from server.kernel.bad_field import BadField

LONG: Final = "x" * 20_000
BAD_VALUES: Final[tuple[Any, ...]] = (
    *(None, True, 0, -1, 10**9, -(10**9), 10**40, 0.5, math.nan, 1e308, "", "secret", LONG, "1" * 5000, "\x00"),
    *("\ud800", "2027-01-31", "2027-01-31T12:00:00", "2027-01-31T12:00:00Z"),
    *([], [""], [1], [{}], [LONG], ["secret"] * 5000, {}, {"secret": 1}, {"command": "secret"}, {"kind": "secret"}),
)


def _inputs(dependant: Dependant) -> Iterator[ModelField]:
    for kind in ("path", "query", "header", "cookie", "body"):
        yield from getattr(dependant, f"{kind}_params")
    for one in dependant.dependencies:
        yield from _inputs(one)


def _models(kind: Any, known: set[type[BaseModel]]) -> None:
    """Adds all models within a type to those `known`."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        if kind not in known:
            known.add(kind)
            for field in kind.model_fields.values():
                _models(field.annotation, known)
    else:
        for part in get_args(getattr(kind, "__value__", kind)):
            _models(part, known)


def _errors() -> Iterator[dict[str, Any]]:
    """What pydantic says to each bad value, in each input of each route and in each field of each model."""
    routes = [route for router in ROUTERS for route in router.routes if isinstance(route, APIRoute)]
    inputs = [one for route in routes for one in _inputs(route.dependant)]
    models: set[type[BaseModel]] = set()
    for one in inputs:
        _models(one.field_info.annotation, models)
        for bad in BAD_VALUES:
            yield from one.validate(bad, {}, loc=("body",))[1]
    assert len(models) > 60
    for model in models:
        for bad in (*BAD_VALUES, *({name: one} for name in model.model_fields for one in BAD_VALUES)):
            try:
                model.model_validate(bad)
            except ValidationError as error:
                yield from error.errors(include_url=False)  # type: ignore[misc]


def test_the_table_has_what_the_models_can_raise_and_no_more() -> None:
    raised: set[str] = set()
    for error in _errors():
        raised.add(error["type"])
        text = field_error(error)
        assert text != OTHER, error["type"]
        assert "secret" not in text, "no text repeats what was sent"
        assert "{" not in text
    assert raised - {"value_error"} == set(FIELD_ERRORS)


@pytest.mark.parametrize(
    ("body", "text"),
    [
        ({"lost_hold_s": 999}, "must be 30 at most"),
        ({"sticks_late_s": -1}, "must be 0.1 at least"),
        ({"lost_hold_s": "soon"}, "must be a number"),
        ({"stream_profile": "secret"}, "must be one of: auto, full, thin, minimal"),
        ({"hold_ladder": ["LOITER", "LOITER"]}, "each mode once"),
        ({"secret": 1}, "no such field is known here"),
    ],
)
def test_a_wrong_field_is_told_with_its_limit_or_its_choices(body: dict[str, Any], text: str) -> None:
    with pytest.raises(ValidationError) as caught:
        DroneSettingsPatch.model_validate(body)
    assert [field_error(one) for one in caught.value.errors()] == [text]


@pytest.mark.parametrize(
    ("error", "text"),
    [
        ({"type": "of a newer pydantic", "msg": "secret"}, OTHER),
        ({"type": "value_error", "ctx": {"error": ValueError("secret")}}, OTHER),
        ({"type": "value_error", "ctx": {"error": BadField("each mode once")}}, "each mode once"),
    ],
)
def test_errors_of_libraries_get_the_general_text(error: dict[str, Any], text: str) -> None:
    assert field_error(error) == text
