"""System identification: a model of a drone from its recorded flight."""
