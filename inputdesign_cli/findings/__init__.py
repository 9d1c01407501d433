"""What speaks for or against data, a model or a design: a file holds the kinds of one cause.

A file says when its finding holds and what its sentence is. It is found by its place: nothing else lists it.
"""

from importlib import import_module
from pkgutil import iter_modules

from inputdesign_cli.diagnostics import Explanation, explanations as of_errors
from inputdesign_cli.finding import KINDS, FindingKind
from inputdesign_cli.specification import plugins


def kinds() -> dict[str, FindingKind]:
    """Return every kind of finding by its code."""
    for module in iter_modules(__path__):
        import_module(f"{__name__}.{module.name}")
    return dict(sorted(KINDS.items()))


def explanations() -> dict[str, Explanation]:
    """Return the explanation of every code: errors first, then findings."""
    found = {code: Explanation(kind.title, kind.text, kind.remedy) for code, kind in kinds().items()}
    added = {code: Explanation(**entry) for code, entry in plugins.codes().items()}
    return {**of_errors(), **found, **added}
