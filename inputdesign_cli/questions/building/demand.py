"""Estimate, before a design starts, whether memory and time suffice for several keys together.

The sizes of single keys stand in `specification.models.sizes`.
"""

from __future__ import annotations

import numpy as np

from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import Model
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.sizes import most
from inputdesign_cli.spectrum import Basis

_MOST_BYTES = 4 * 2**30
_NODES = 2000  # of an integral, where poles are well damped
_COPIES = 4  # of a record's gradient while its information matrix is formed
# A round takes _STEPS steps of the solver. Each factors the matrices of _CUTS cuts, and sums the products of
# all pairs of entries of the information matrix for _UNKNOWNS unknowns.
_CUTS, _STEPS, _ROUNDS, _UNKNOWNS = 50, 15, 15, 250
_CRITERION, _FACTORINGS = 4, 60
_PER_SECOND = 1e10  # multiplications
_PROBES, _TRACE = 40, 1e-12
_GENEROUS = 10  # hard plants take this many times as long as the first rounds


def check_model(spec: Spec, model: Model) -> None:
    """Refuse models whose gradients do not fit into memory. It raises `SpecError` (`too-large`)."""
    channels = model.outputs * model.inputs
    room = _MOST_BYTES // (16 * _NODES * channels)
    if len(model.names) > room:
        what = f"a model of {len(model.names)} parameters and {channels} entries"
        raise _too_large(spec, "plant", what, f"{room} parameters")


def check_effects(spec: Spec, experiment: Experiment) -> None:
    """Refuse plants with a parameter that changes G by no more than rounding.

    The change is a shift by the whole value; a parameter that is zero must have some effect on G.

    Raises:
        SpecError: `without-effect`.
    """
    model, (lo, hi) = experiment.model, experiment.band
    w = np.union1d(np.linspace(lo, hi, _PROBES + 1)[1:-1], np.geomspace(max(lo, 1e-4 * hi), hi, _PROBES)[:-1])
    G, slope = np.abs(model.plant_at(w)), np.abs(model.plant_gradient(w))
    moved = slope * np.abs(model.theta)[:, None, None]
    small = np.all((moved < _TRACE * G[:, None]) | (slope == 0.0), axis=(0, 2, 3)) & (model.theta != 0.0)
    silent = ~np.any(slope, axis=(0, 2, 3)) & ~np.any(model.noise_gradient(w), axis=(0, 2, 3))
    lost = model.in_plant & (silent | small)
    if not np.any(lost):
        return
    names = ", ".join(name for name, listed in zip(model.names, lost, strict=True) if listed)
    still = np.any(model.in_plant & silent)
    what = "a small change of it does not change G" if still else "G hardly changes with all of its value"
    other = "choose nominal values at which G depends on it" if still else "sample faster (sample_time)"
    message = f"{names}: {what} at any frequency of the experiment, so that no data determine it"
    hint = f"{other}, or write plant.known: [{names}]"
    raise spec.complain("without-effect", message, hint=hint, key="plant")


def check_design(spec: Spec, experiment: Experiment, basis: Basis) -> None:
    """Refuse convex designs that do not fit into memory, or whose first rounds exceed the time limit.

    A program has a matrix inequality of the order of the information matrix for each frequency that binds.

    Raises:
        SpecError: `too-large`.
    """
    size = experiment.size
    if basis.size * size**2 * 8 > _MOST_BYTES:
        known = f"a spectrum of {basis.size} unknowns for a model of {size} parameters"
        raise _too_large(spec, "spectrum", known, f"{_MOST_BYTES // (8 * size**2)} unknowns")
    accuracy = spec.accuracy
    inequalities = len(accuracy.standard_deviation or ()) + (_CRITERION if accuracy.criterion else 0)
    if accuracy.error is not None or accuracy.weighted_variance is not None:
        inequalities += _CUTS

    def seconds(parameters: int) -> float:
        entries = parameters * (parameters + 1) / 2
        step = inequalities * (_FACTORINGS * parameters**3 + entries**2)
        step += entries**2 * _UNKNOWNS
        return step * _STEPS * _ROUNDS / _PER_SECOND

    # Anything below a second is tried.
    limit = max(spec.solver.time_limit, 1.0)
    if seconds(size) > limit:
        fits = max(k for k in range(size) if seconds(k) <= limit)
        need = f"a design for a model of {size} parameters would take {seconds(size):.0f} seconds or more"
        longer = f"solver.time_limit: {float(f'{_GENEROUS * seconds(size):.2g}'):.0f} or more"
        hint = f"{fits} parameters fit: lower the orders, or write {longer}"
        raise spec.complain("too-large", f"{need}; solver.time_limit is {limit:g}", hint=hint, key="plant")


def check_record(spec: Spec, parameters: int) -> None:
    """Refuse records that are too long; without a section `signal` they are left out later.

    Raises:
        SpecError: `too-large`.
    """
    room = longest_record(parameters, spec.plant.outputs)
    samples = spec.signal_samples
    stated = "signal" in spec.model_fields_set and spec.goal != "shortest_experiment"
    if samples > room and (stated or spec.plant.kind == "regression"):
        key = "signal.samples" if spec.signal.samples else "experiment.samples"
        message = f"the record has {samples} samples, and at most {room} are computed for this model"
        hint = f"write signal.samples: {room} or less; experiment.samples may be as large as you like"
        raise spec.complain("too-large", message, hint=hint, key=key)


def longest_record(parameters: int, outputs: int) -> int:
    """Return the most samples of a record whose gradient fits into memory."""
    return min(_MOST_BYTES // (8 * _COPIES * parameters * outputs), most("signal.samples"))


def _too_large(spec: Spec, key: str, what: str, fits: str) -> Exception:
    message = f"{what} takes more than {_MOST_BYTES / 2**30:.0f} GiB of memory"
    return spec.complain("too-large", message, hint=f"at most {fits} fit: lower the orders", key=key)
