"""The simulated land as map files: what its cameras see, as imagery and as a vector map with names.

It is drawn from the description that the cameras draw their ground from, so map and picture agree.
"""
