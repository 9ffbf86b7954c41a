"""Finds a controller by its name: built in, a file of the agent's settings, or an installed package's entry point."""

import importlib
import importlib.util
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from onboard_agent.autonomy.controller import Controller
from onboard_agent.autonomy.setting import BUILT_IN, GROUP


class NoController(Exception):
    """There is none of this name, or it is none."""


def load(name: str, source: str) -> Controller:
    """Returns a new controller. `source`: FILE:CLASS, or empty. Raises NoController, and whatever its code raises."""
    made = loaded_class(name, source)()
    if not callable(getattr(made, "step", None)):
        raise NoController(f"{name} has no method step")
    controller: Controller = made
    return controller


def loaded_class(name: str, source: str) -> Any:
    """Returns what makes the controller. Raises as `load`."""
    if source:
        path, _, class_name = source.rpartition(":")
        return getattr(_module_of(Path(path)), class_name)
    if name in BUILT_IN:
        module, class_name = BUILT_IN[name]
        return getattr(importlib.import_module(module), class_name)
    for entry in entry_points(group=GROUP, name=name):
        return entry.load()
    raise NoController(f"there is no controller {name!r}: neither built in, nor in agent.toml, nor installed")


def _module_of(path: Path) -> Any:
    spec = importlib.util.spec_from_file_location(f"controller_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise NoController(f"{path} is no Python file")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
