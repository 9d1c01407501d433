"""The model file that `identify` writes, read for what it says of its estimate."""

from __future__ import annotations

from pydantic import ValidationError

from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification.models.experiment import Estimated
from inputdesign_cli.specification.models.pydantic_errors import translate
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.yaml.files import read_text
from inputdesign_cli.specification.yaml.places import format_key
from inputdesign_cli.specification.yaml.reader import read


def load_estimate(spec: Spec, name: str, key: str) -> Estimated:
    """The block `estimate` of a file that the spec names at `key`; nothing else of the file is shown.

    Raises:
        SpecError: `bad-model-file`; what is wrong with the file itself.
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
        try:
            return Estimated.model_validate(block)
        except ValidationError as error:
            first = translate(error, block, Estimated)[0]
            said = f" ({first.code} at {format_key(['estimate', *first.path])})"
            raise
    except (SpecError, ValidationError) as error:
        raise spec.complain(
            "bad-model-file",
            f"{name} cannot be read as a model that identify wrote: it has no sound block estimate{said}",
            hint="name a model.yaml, which holds estimate: {parameters: {..}, covariance: [[..]]} with a "
            "covariance that is positive definite",
            key=key,
        ) from error
