"""Compiling: whether somebody waits for the compiler. Numba is not imported to ask."""

from typing import Final

compiling: Final[set[object]] = set()
"""Whoever waits for the compiler now; empty where nobody does."""
