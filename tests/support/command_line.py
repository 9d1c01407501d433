"""A result and a diagnostic for tests of commands."""

from inputdesign_cli.errors import Diagnostic, Location

RESULT = {
    "format": 1,
    "title": "First-order system",
    "objective": {
        "kind": "least_cost",
        "value": 0.258498,
        "lower_bound": 0.2584979,
        "relative_gap": 1e-7,
        "any_spectrum_bound": 0.192547,
    },
    "cost": 0.258498,
    "power": {"input": [0.258498], "output": [3.5], "excitation": [0.258498]},
    "model_error": {"worst_ratio": 1.0, "worst_frequency": 3.14159, "alpha": 2.45},
    "spectrum": {"type": "fir"},
    "baseline": {"white": {"cost": 1.705495, "ratio": 6.597711}},
    "signal": {"samples": 500, "power": [0.26], "peak": [1.5], "crest_factor": [2.94], "worst_ratio": 1.02},
}


def diagnostic(code="some-code"):
    place = Location("a.yaml", 3, 7, "plant: {F: [1, -1.7]}")
    return Diagnostic(code, "the plant is unstable", "move its pole", "plant.F", place)
