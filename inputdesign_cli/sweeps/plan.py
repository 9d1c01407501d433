"""The plan of a sweep: a draft, a grid, a verb, and the key by which each point is known for good."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import get_args

from inputdesign_cli.errors import STANDARD_STREAM, OutputError, SpecError, bad_spec
from inputdesign_cli.outcome.origin import digest
from inputdesign_cli.outcome.record import environment
from inputdesign_cli.questions import Verb
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.specification import SpecTemplate, read_template
from inputdesign_cli.specification.yaml.plain import to_yaml
from inputdesign_cli.sweeps.grid import Grid, Settings, build_grid, parse_settings
from inputdesign_cli.sweeps.layout import SUMMARY
from inputdesign_cli.sweeps.point import PointJob
from inputdesign_cli.version import __version__

_KEY_LENGTH = 24
_TRIED = 50


@dataclass(frozen=True)
class Plan:
    """Holds the points of a sweep, in order; `source` is the file of the spec, or standard input."""

    draft: SpecTemplate
    grid: Grid
    verb: Verb
    source: Path
    _keys: list[str] = field(default_factory=list, repr=False)

    def key(self, index: int) -> str:
        """Return the key of a point, which the spec, its files, the verb and the version determine."""
        while len(self._keys) <= index:
            overrides = self.grid.overrides(self.grid[len(self._keys)])
            try:
                found = self.draft.digest(self.draft.variant(overrides))
            except SpecError:
                found = json.dumps([self.draft.digest(self.draft.data), overrides])
            name = f"{__version__} {self.verb} {found}"
            self._keys.append(
                hashlib.sha256(name.encode(errors="backslashreplace")).hexdigest()[:_KEY_LENGTH]
            )
        return self._keys[index]

    def job(self, index: int, root: Path | None, *, figures: str) -> PointJob:
        """Return the job of a point for a worker; without `root` it carries the files that the spec names."""
        overrides = tuple(self.grid.overrides(self.grid[index]))
        files = None
        if root is None:
            with suppress(SpecError):
                names = [*self.draft.included, *self.draft.files(self.draft.variant(overrides))]
                files = {name: read_regular(self.draft.folder / name) for name in names}
        return PointJob(index, self.key(index), self.draft, overrides, self.verb, figures, root, files)

    def resolved(self, index: int) -> str | None:
        """Return the `spec.yaml` of a point, or None for an invalid spec."""
        try:
            return self.draft.spec(self.grid.overrides(self.grid[index])).to_yaml()
        except SpecError:
            return None

    def check(self) -> None:
        """Refuse a sweep that is wrong as a whole (a misspelt key), rather than fail its every point.

        Raises:
            SpecError: the error of the first point, if no point that is tried can be read.
        """
        first: SpecError | None = None
        for index in dict.fromkeys(i * (len(self.grid) - 1) // _TRIED for i in range(_TRIED + 1)):
            try:
                self.draft.spec(self.grid.overrides(self.grid[index]))
            except SpecError as error:
                first = first or error
            else:
                return
        if first is not None:
            raise first

    def data(self) -> dict[str, object]:
        """Return the spec with the grid as its `sweep` block: it repeats the sweep without any settings."""
        return {**self._base, "sweep": self.grid.block()}

    @property
    def _base(self) -> dict[str, object]:
        """Return the content of the spec without its parts about a sweep."""
        return {key: value for key, value in self.draft.data.items() if key != "sweep"}

    def summary(self, made_from: Sequence[str], statuses: Mapping[str, int]) -> dict[str, object]:
        """Return the content of sweep.json.

        Args:
            made_from: the spec file as it is seen from the directory.
            statuses: the number of points of each status.
        """
        return {
            "format": 1,
            "kind": "sweep",
            "title": str(self.draft.data.get("title", "")),
            "verb": self.verb,
            "made_from": list(made_from),
            "asked_sha256": digest(to_yaml(self._base)),
            "axes": [{"key": axis.key, "values": list(axis.texts)} for axis in self.grid.axes],
            "zip": self.grid.zipped,
            "points": len(self.grid),
            "statuses": statuses,
            "environment": environment(),
        }

    def check_place(self, made_from: Sequence[str], root: Path) -> None:
        """Refuse a directory with the sweep of another spec, of other keys, or of another command.

        The same spec file, or a spec that says the same, may go on with other values of the same keys.

        Raises:
            OutputError: `output-other-run`.
        """
        try:
            there = json.loads(read_regular(root / SUMMARY))
            keys = [axis["key"] for axis in there["axes"]]
            verb, theirs, asked = there["verb"], there.get("made_from"), there.get("asked_sha256")
        except (OSError, ValueError, RecursionError, KeyError, TypeError):
            return  # a sweep that was killed at its very start left nothing to compare
        ours = [axis.key for axis in self.grid.axes]
        same_file = theirs == list(made_from) != [STANDARD_STREAM]
        if verb != self.verb:
            what = f"the command {verb}, not {self.verb}"
        elif set(keys) != set(ours):
            what = f"{', '.join(map(str, keys))}, not {', '.join(ours)}"
        elif not same_file and asked != digest(to_yaml(self._base)):
            what = "another spec" + (f" ({theirs[0]} as seen from there)" if theirs else "")
        else:
            return
        raise OutputError.because(
            "output-other-run",
            f"{root} holds the sweep of {what}, and would lose its table",
            hint="choose another directory with -o, or replace the sweep with --overwrite",
        )


def build_plan(
    spec: Path,
    settings: Settings,
    *,
    zipped: bool = False,
    verb: Verb = "solve",
    confine: Path | None = None,
    text: str | None = None,
) -> Plan:
    """Build the plan of a sweep from a spec and from settings as of `parse_settings`.

    Args:
        spec: the file, or with `text` where it would lie.
        confine: the folder outside of which the spec may name no files.
        text: the text of the spec, where it is in no file.

    Raises:
        SpecError: the spec, its `sweep` block or a setting cannot be used, or no point is a spec.
    """
    if verb not in get_args(Verb):
        hint = "sweep with --verb solve"
        raise bad_spec("not-supported", f"this version does not {verb} anything", hint=hint)
    fixed, axes = parse_settings(settings)
    draft = read_template(spec, fixed, confine=confine, text=text)
    source = Path(STANDARD_STREAM) if text is not None else spec
    plan = Plan(draft, build_grid(draft.sweep(), axes, zipped=zipped), verb, source)
    plan.check()
    return plan
