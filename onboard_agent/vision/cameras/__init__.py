"""Pictures for target finding, from any source that live video knows."""
