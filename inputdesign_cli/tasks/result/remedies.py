"""What mends a structure that data refute, in the words in which its spec states it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from inputdesign_cli.plant import Model
from inputdesign_cli.runs.results import Json
from inputdesign_cli.tasks.result.blocks import blocks_of

_SHARE = 0.1  # of the lag that is there: where the search for another one begins
_QUANTITIES = ("gain", "time_constant", "dead_time")
_LAG = "one more lag, [T2, 1] as another factor of the denominator (a list of factors) and T2 in parameters"


def remedies_of(model: Model) -> dict[str, str]:
    """By what the tests find, `plant`, `noise` or `drift`, the keys to change."""
    blocks = blocks_of(model)
    plant, known = _of_plant(blocks["plant"]), blocks["plant"].get("known")
    if known:
        plant = f"see whether what is known is right (plant.known: {', '.join(known)}; without it, it is "
        plant += f"estimated), or {_of_plant(blocks['plant'])}"
    return {"plant": plant, **_of_noise(model, blocks)}


def vague_notes(model: Model, vague: Sequence[str]) -> list[str]:
    """Notes on parameters that data may take for zero: coefficients have orders, quantities do not."""
    plant = blocks_of(model)["plant"]
    named = "parameters" in plant or "gain" in plant.get("continuous", {})
    quantity = (model.in_plant & named) | model.dead_times
    of_kind = dict(zip(model.names, quantity, strict=True))
    notes = []
    for physical, advice in (
        (True, "the data hardly tell of it; take more of them, or list what is known in plant.known"),
        (False, "an order may be too high"),
    ):
        listed = ", ".join(name for name in vague if of_kind[name] == physical)
        if listed:
            notes.append(f"zero lies within a standard deviation of {listed}: {advice}")
    return notes


def _of_plant(plant: Mapping[str, Json]) -> str:
    stated = plant.get("continuous", {})
    if "gain" in stated:
        return _lag_more(stated)
    if "state_space" in plant:
        return "give A, B and C of the state space one more state"
    if "parameters" not in plant:
        if "continuous" in plant:
            return "raise the orders of numerator and denominator"
        return "raise the orders of B and F (or A), or change the delay"
    if "continuous" in plant:
        return f"give the numerator one more coefficient, or the denominator {_LAG}"
    return "give B or F (or A) one more coefficient, by a name in parameters"


def _lag_more(stated: Mapping[str, Json]) -> str:
    """Gain, time constant and dead time by names, and one more lag, to begin the search with."""
    lag = stated["time_constant"]
    if not all(isinstance(stated.get(name, 0.0), (int, float)) for name in _QUANTITIES):
        return "write entries by numerator and denominator, with one more lag, in place of " + ", ".join(
            name for name in _QUANTITIES if name in stated
        )
    values = {"K": stated["gain"], "T1": lag, "T2": _SHARE * lag, "L": stated.get("dead_time", 0.0)}
    late = ", delay: L" if values["L"] else ""
    listed = ", ".join(f"{name}: {value:.4g}" for name, value in values.items() if name != "L" or late)
    keys = "gain, time_constant and dead_time" if late else "gain and time_constant"
    return (
        f"write plant.parameters: {{{listed}}} and plant.continuous: {{numerator: [K], denominator: "
        f"[[T1, 1], [T2, 1]]{late}}} in place of {keys}"
    )


def _of_noise(model: Model, blocks: Mapping[str, Mapping[str, Json]]) -> dict[str, str]:
    plant, noise = blocks["plant"], blocks["noise"]
    if model.continuous:
        sampled = "sample the plant (plant.sample: zoh), so that noise may have"
        return {"noise": f"{sampled} C and D", "drift": f"{sampled} drift: true"}
    first = " (such as noise: {C: [1, -0.1], D: [1, -0.8]})" if not {"C", "D"} & set(noise) else ""
    polynomials = "" if "continuous" in plant or "state_space" in plant else " (or A)"
    drifts = "drift" in noise
    drift = "raise the order of D under noise" if drifts else "let the noise drift (noise: {drift: true})"
    return {"noise": f"raise the orders of C and D under noise{first}{polynomials}", "drift": drift}
