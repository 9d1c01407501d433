"""Where a spec came from: its plain data, the places of its keys, the folder of its file."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from inputdesign_cli.specification.yaml.places import Places


@dataclass
class Source:
    """What a spec remembers of its file; empty for a spec that was built in Python."""

    data: dict[str, Any] = field(default_factory=dict)
    places: Places = field(default_factory=Places)
    folder: Path = field(default_factory=Path)
