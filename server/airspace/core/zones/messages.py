"""What browsers are told of zones."""

import msgspec


class ZonesChanged(msgspec.Struct, frozen=True, tag="zones", tag_field="type"):
    """Zones that this browser may see have changed: `GET /zones` has them."""
