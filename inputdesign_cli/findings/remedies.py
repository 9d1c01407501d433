"""Remedies for a structure that data refute, in the words in which its spec states it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.outcome.model_words import Plain, blocks_of
from inputdesign_cli.plant import Model

_SHARE = 0.1  # of the lag that is there: where the search for another one begins
_LAG = "one more lag, [T2, 1] as another factor of the denominator (a list of factors) and T2 in parameters"


def remedies_of(model: Model) -> dict[str, str]:
    """Return the keys to change, by what the tests find: `plant`, `noise` or `drift`."""
    blocks = blocks_of(model)
    plant, known = _of_plant(blocks["plant"]), blocks["plant"].get("known")
    if known:
        plant = f"see whether what is known is right (plant.known: {', '.join(known)}; without it, it is "
        plant += f"estimated), or {_of_plant(blocks['plant'])}"
    return {"plant": plant, **_of_noise(model, blocks)}


def quantities(model: Model) -> NDArray[np.bool_]:
    """(k,): whether each parameter is a physical quantity, of which no order can be too high."""
    plant = blocks_of(model)["plant"]
    named = "parameters" in plant or "gain" in plant.get("continuous", {})
    return np.asarray((model.in_plant & named) | model.dead_times)


def _of_plant(plant: Mapping[str, Plain]) -> str:
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


def _lag_more(stated: Mapping[str, Plain]) -> str:
    """Return the advice that writes a plant given by gain and time constants with an additional lag."""
    kept = ", ".join(stated)
    if not all(isinstance(value, (int, float)) for value in stated.values()):
        return f"write entries by numerator and denominator, with one more lag, in place of {kept}"
    if "time_constant" in stated:
        slow, poles, own = stated["time_constant"], "[T1, 1]", {"T1": stated["time_constant"]}
    else:
        slow, poles = 1.0 / stated["natural_frequency"], "[1/w**2, 2*zeta/w, 1]"
        own = {"zeta": stated["damping"], "w": stated["natural_frequency"]}
    values = {"K": stated["gain"], **own, "T2": _SHARE * slow}
    late = ""
    if stated.get("dead_time"):
        late, values["L"] = ", delay: L", stated["dead_time"]
    listed = ", ".join(f"{name}: {value:.4g}" for name, value in values.items())
    return (
        f"write plant.parameters: {{{listed}}} and plant.continuous: {{numerator: [K], denominator: "
        f"[{poles}, [T2, 1]]{late}}} in place of {kept}"
    )


def _of_noise(model: Model, blocks: Mapping[str, Mapping[str, Plain]]) -> dict[str, str]:
    plant, noise = blocks["plant"], blocks["noise"]
    if model.continuous:
        sampled = "sample the plant (plant.sample: zoh), so that noise may have"
        return {"noise": f"{sampled} C and D", "drift": f"{sampled} drift: true"}
    first = " (such as noise: {C: [1, -0.1], D: [1, -0.8]})" if not {"C", "D"} & set(noise) else ""
    polynomials = "" if "continuous" in plant or "state_space" in plant else " (or A)"
    drifts = "drift" in noise
    drift = "raise the order of D under noise" if drifts else "let the noise drift (noise: {drift: true})"
    return {"noise": f"raise the orders of C and D under noise{first}{polynomials}", "drift": drift}
