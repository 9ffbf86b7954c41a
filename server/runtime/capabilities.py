"""Finds what the capabilities have, by its place. Nothing lists them: a new folder is enough."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from types import ModuleType
from typing import Final

import server

COMMON: Final = frozenset({"app", "http", "kernel", "live", "runtime", "storage"})
"""The folders of `server` that are no capability: what all of them use, and what assembles them."""


def capabilities() -> Iterator[str]:
    """Yields the packages of the capabilities, in the order of their names."""
    for found in pkgutil.iter_modules(server.__path__):
        if found.ispkg and found.name not in COMMON:
            yield f"server.{found.name}"


def in_every_capability(module: str) -> Iterator[ModuleType]:
    """Imports and yields the modules with this name, one for each capability that has it."""
    for capability in capabilities():
        package = importlib.import_module(capability)
        if any(found.name == module for found in pkgutil.iter_modules(package.__path__)):
            yield importlib.import_module(f"{capability}.{module}")


def table_modules() -> Iterator[ModuleType]:
    """Imports and yields the modules below a `store/` whose name ends with `tables`."""
    for capability in capabilities():
        package = importlib.import_module(capability)
        for found in pkgutil.walk_packages(package.__path__, f"{capability}."):
            if found.name.startswith(f"{capability}.store.") and found.name.endswith("tables"):
                yield importlib.import_module(found.name)
