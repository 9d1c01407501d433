"""Findings for or against data, a model or a design: a file holds the kinds of one cause.

A file decides when its findings hold and words their messages. It is found by its place: nothing lists it.
"""

from contextlib import suppress
from importlib import import_module
from pkgutil import iter_modules

from inputdesign_cli.diagnostics import Explanation, explanations as of_errors
from inputdesign_cli.errors import SpecError
from inputdesign_cli.finding import DOUBT, KINDS, NOTE, FindingKind
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.plugins import loaded, points, refused
from inputdesign_cli.specification import plugins


def kinds() -> dict[str, FindingKind]:
    """Return every kind of finding by its code, and what other packages add."""
    for module in iter_modules(__path__):
        import_module(f"{__name__}.{module.name}")
    with suppress(SpecError):  # explanations are needed even if a plug-in is broken
        for point in points("idesign.findings").values():
            loaded(point)
    return dict(sorted(KINDS.items()))


def explanations() -> dict[str, Explanation]:
    """Return the explanation of every code: errors first, then findings."""
    found = {code: Explanation(kind.title, kind.text, kind.remedy) for code, kind in kinds().items()}
    added = {code: Explanation(**entry) for code, entry in plugins.codes().items()}
    return {**of_errors(), **found, **added}


def with_added(results: Results) -> Results:
    """Return the results with the findings that functions of other packages add.

    Each entry point of `idesign.findings` refers to a function that takes the results and returns findings.
    The results have their verdict already.

    Raises:
        SpecError: `bad-plug-in`, a function cannot be loaded, or fails. Or it gives something other than
            notes and doubts with declared codes and finite figures.
    """
    for point in points("idesign.findings").values():
        find = loaded(point)
        if not callable(find):
            raise refused(point, "is no function from results to findings")
        try:
            found = list(find(results))
        except Exception as error:  # whatever the code of another package raises
            raise refused(point, f"gives no list of findings: {type(error).__name__}: {error}") from error
        if not all(getattr(one, "severity", None) in (NOTE, DOUBT) for one in found):
            raise refused(point, "gives something that is no note and no doubt")
        if undeclared := [one.code for one in found if one.code not in KINDS]:
            raise refused(point, f"gives {', '.join(undeclared)}, which no function declares with @finding")
        results = results.saying(found) if found else results
        try:
            _ = results.result
        except (TypeError, ValueError) as error:
            raise refused(point, f"gives figures that cannot be written: {error}") from error
    return results
