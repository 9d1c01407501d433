"""Results in a form that can be compared: numbers to eight digits, long lists by a few of their properties.

`python -m tests.contract.condensed FOLDER OUT.json` condenses every FOLDER/*/result.json.
"""

import json
import sys
from pathlib import Path

# Fields that differ between runs or machines, and sentences, whose wording is free.
PASSED_OVER = {
    *("timing_s", "environment", "spec_sha256", "signal_sha256", "asked_sha256", "made_from", "files"),
    *("notes", "findings", "undecided", "reasons", "steps", "why", "message", "caveat", "no_top_up"),
}
LONGEST = 12


def condensed(value):
    if isinstance(value, dict):
        return {key: condensed(item) for key, item in value.items() if key not in PASSED_OVER}
    if isinstance(value, list):
        numbers = all(isinstance(item, int | float) for item in value)
        if numbers and len(value) > LONGEST:
            size = sum(abs(item) for item in value)
            return {"length": len(value), "first": condensed(value[0]), "size": condensed(float(size))}
        if len(value) > LONGEST:
            return {"length": len(value), "first": condensed(value[0]), "last": condensed(value[-1])}
        return [condensed(item) for item in value]
    return float(f"{value:.8g}") if isinstance(value, float) else value


if __name__ == "__main__":
    results = sorted(Path(sys.argv[1]).glob("*/result.json"))
    found = {path.parent.name: condensed(json.loads(path.read_text())) for path in results}
    Path(sys.argv[2]).write_text(json.dumps(found, indent=0, sort_keys=True))
