"""Loads a module that is slow to load when it is first needed, in a thread: the loop passes sticks on meanwhile."""

import asyncio
import sys
from importlib import import_module


async def load_late(name: str) -> None:
    """Returns when `name` is loaded; an import of it then takes no time."""
    if name not in sys.modules:
        await asyncio.to_thread(import_module, name)
