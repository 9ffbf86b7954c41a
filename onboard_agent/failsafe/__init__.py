"""Holds, losses and lost actions: the last line of safety. No I/O."""
