"""The size of the shared memory for the newest picture (`video.frame_share`). Loads no picture library."""

from typing import Final

HEADER_BYTES: Final = 4096
MAX_WIDTH_PX: Final = 1920
MAX_HEIGHT_PX: Final = 1080
SIZE_BYTES: Final = HEADER_BYTES + 3 * MAX_WIDTH_PX * MAX_HEIGHT_PX
"""Memory is used only as far as a picture reaches."""
