"""Whether a drone may fly: checklist before flight, maintenance."""
