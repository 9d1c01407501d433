"""Plain data, as YAML gives them."""

from __future__ import annotations

from typing import Any

Plain = Any
"""A number, a text, true, false or nothing, or lists and mappings of them: not checked by any model yet.

This is the one place where the type is open. A union that names itself would have every reader ask again
for the type of each step; the models do that once.
"""
