"""Read the estimate in a model file that `identify` wrote."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isclose

from pydantic import ValidationError

from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification.models.experiment import Estimated
from inputdesign_cli.specification.models.pydantic_errors import translate
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.yaml.files import read_text
from inputdesign_cli.specification.yaml.places import format_key
from inputdesign_cli.specification.yaml.reader import read

# Sample times differ by this share at most, from rounding in a text.
_SAME = 1e-6


def load_estimate(spec: Spec, name: str, key: str) -> Estimated:
    """Return the block `estimate` of a file that the spec names at `key`; errors show nothing else of it.

    Raises `SpecError`: `bad-model-file`; `wrong-estimate`, of another sample time; it cannot be read.
    """
    try:
        text = read_text(spec.resolve_path(name))
    except SpecError as error:
        found = error.diagnostics[0]
        hint = found.hint or "paths are relative to the folder of the spec"
        raise spec.complain(found.code, found.message, hint=hint, key=key) from error
    said = ""
    try:
        data = read(text, name).data
        block = data.get("estimate") if isinstance(data, dict) else None
        estimated = Estimated.model_validate(block)
    except (SpecError, ValidationError) as error:
        if isinstance(error, ValidationError):
            first = translate(error, block, Estimated)[0]
            said = f" ({first.code} at {format_key(['estimate', *first.path])})"
        message = f"{name} is no model that identify wrote: it has no sound block estimate{said}"
        hint = "name a model.yaml with estimate: {parameters: {..}, covariance: [[..]]}, positive definite"
        raise spec.complain("bad-model-file", message, hint=hint, key=key) from error
    step, unit = data.get("sample_time"), data.get("time_unit", spec.time_unit)
    other = unit != spec.time_unit
    # Older files have no sample time.
    if isinstance(step, int | float) and (other or not isclose(step, spec.sample_time, rel_tol=_SAME)):
        here = f"sample_time is {spec.sample_time:g} {spec.time_unit} here"
        message = f"{name} is an estimate from samples {step:g} {unit} apart, and {here}"
        hint = f"write sample_time: {step!r} and time_unit: {unit}, or take them by include: {name}"
        raise spec.complain("wrong-estimate", message, hint=hint, key=key)
    return estimated


def is_prior(parameters: Mapping[str, float], covariance: Sequence[Sequence[float]]) -> bool:
    """Return whether a later spec will accept an estimate: its covariance is clearly positive definite."""
    try:
        Estimated.model_validate({"parameters": parameters, "covariance": covariance})
    except ValidationError:
        return False
    return True
