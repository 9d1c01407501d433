"""Calls that must be refused, and their diagnostics."""

from collections.abc import Callable

import pytest

from inputdesign_cli.errors import Diagnostic, IdesignError, SpecError


def refusals(ask: Callable[[], object], kind: type[IdesignError] = SpecError) -> tuple[Diagnostic, ...]:
    """All complaints with which `ask` ends, in an error of this kind."""
    return refused(ask, kind=kind)


def refused(
    call: Callable[..., object], *given: object, kind: type[IdesignError] = SpecError, **named: object
) -> tuple[Diagnostic, ...]:
    """All complaints with which a call with these arguments ends, in an error of this kind."""
    with pytest.raises(kind) as caught:
        call(*given, **named)
    return caught.value.diagnostics


def refusal(ask: Callable[[], object], kind: type[IdesignError] = SpecError) -> Diagnostic:
    """The only complaint with which `ask` ends."""
    (found,) = refusals(ask, kind)
    return found


def code_of(
    call: Callable[..., object], *given: object, kind: type[IdesignError] = SpecError, **named: object
) -> str:
    """The code of the only complaint with which a call with these arguments ends."""
    (found,) = refused(call, *given, kind=kind, **named)
    return found.code
