"""Plain data, as YAML gives them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

Plain = Any
"""A number, a text, true, false or nothing, or lists and mappings of them: not checked by any model yet.

This is the one place where the type is open. A union that names itself would have every reader ask again
for the type of each step; the models do that once.
"""


def plain(value: object) -> Plain:
    """Mappings, lists and tuples, numbers and arrays of numpy as plain data."""
    if isinstance(value, Mapping):
        return {str(key): plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value
