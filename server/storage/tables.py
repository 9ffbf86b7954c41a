"""Every table of the tower, for migrations and the start-up check: what the modules `tables` of the stores declare."""

from typing import Final

from server.runtime.capabilities import table_modules
from server.storage.database import Base

ALL: Final = tuple(table_modules())
METADATA: Final = Base.metadata
