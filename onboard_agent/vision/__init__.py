"""Target finding: landing targets and markers in camera pictures, and where they lie.

A library: the agent imports nothing of it before something asks for it. Modules that say "pure" in their first lines
load neither NumPy nor OpenCV; the others need the agent's extra `video`.
"""
