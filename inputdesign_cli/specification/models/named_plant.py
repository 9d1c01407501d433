"""Plants whose coefficients are numbers, or expressions in named parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Self

from pydantic import Field, ModelWrapValidatorHandler, PrivateAttr, model_validator

from inputdesign_cli.specification.models.fields import Names, Number
from inputdesign_cli.specification.models.named import (
    NamedParameter,
    check_names,
    check_used,
    texts_in,
    values_of,
    worth,
)
from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic, carry
from inputdesign_cli.specification.models.section import Section
from inputdesign_cli.specification.models.sizes import SIZES
from inputdesign_cli.specification.yaml.plain import Plain


class NamedPlant(Section):
    """What plants have in common whose coefficients may be expressions in named parameters."""

    TAKE_EXPRESSIONS: ClassVar[tuple[str, ...]] = ()

    parameters: Annotated[Mapping[str, Number], SIZES["plant.parameters"]] | None = Field(
        default=None,
        min_length=1,
        description="Named parameters and their values. Coefficients may then be expressions in them, and "
        "these alone are estimated.",
        examples=[{"K": 2.1, "T": 180}],
    )
    known: Names | None = Field(
        default=None, description="Names of parameters that are known and not estimated.", examples=[["b1"]]
    )

    _written: dict[str, Plain] = PrivateAttr(default_factory=dict)

    @model_validator(mode="wrap")
    @classmethod
    def _worth(cls, data: Plain, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """The section with the values of its expressions; it remembers what was written."""
        if not isinstance(data, dict):
            return handler(data)
        numbers = dict(data)
        if isinstance(data.get("parameters"), dict):
            values = values_of(data["parameters"])
            if len(values) > SIZES["plant.parameters"].most:
                return handler(numbers)
            found = list(check_names(values))
            stated = [key for key in cls.TAKE_EXPRESSIONS if key in data]
            numbers |= {key: worth(data[key], values, (key,), found) for key in stated}
            if not found:
                found += check_used(values, texts_in([data[key] for key in stated]))
            if found:
                raise carry(*found)
        made = handler(numbers)
        made._written = dict(data)
        if wrong := tuple(made.check_written()):
            raise carry(*wrong)
        return made

    def check_written(self) -> Iterator[PathDiagnostic]:
        """What is wrong with what its coefficients are, whatever the values of its parameters."""
        return iter(())

    @property
    def written(self) -> dict[str, Plain]:
        """The section as it was written, with its expressions."""
        return self._written

    @property
    def named_parameters(self) -> tuple[NamedParameter, ...]:
        """Parameters with names of their own; none where the coefficients are the parameters."""
        stated = self.parameters or {}
        return tuple(NamedParameter(k, k, value, ("parameters", k)) for k, value in stated.items())
