"""`idesign wizard`: questions in the user's words, a commented spec, and the verdict on its design."""

from __future__ import annotations

import shlex
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from inputdesign_cli.cli.applying import instructions
from inputdesign_cli.cli.options import TRADED, Into, Shown, refuse_existing
from inputdesign_cli.cli.run import Place, keep
from inputdesign_cli.cli.terminal import complain, computing, status
from inputdesign_cli.errors import OutputError, SpecError

if TYPE_CHECKING:
    from inputdesign_cli.outcome.results import Result
    from inputdesign_cli.specification import Spec
    from inputdesign_cli.wizard.composing import Draft
    from inputdesign_cli.wizard.questions import Answers


def wizard(
    sentence: str | None = None,
    *,
    answers: Path | None = None,
    given: list[str] | None = None,
    output: Path = Path("experiment.yaml"),
    solve: bool | None = None,
    trade: bool = False,
    overwrite: bool = False,
    quiet: bool = False,
) -> None:
    """Ask for an experiment in your words, and write a commented spec.

    The plant, what the model is for, what the experiment may use, the noise: say it in SENTENCE, and three
    questions are left. Without it all are asked that no option answers, in the terminal or from a pipe, a
    line an answer; KEY=TEXT answers a question out of turn. The middle of the range is the operating point:
    `idesign assess` takes it as --operating-point. What is written is an ordinary spec.
    """
    from inputdesign_cli.wizard.questions import needed_of, read_answers, taken_for_granted
    from inputdesign_cli.wizard.sentence import not_understood, spread

    if answers is not None and output.exists() and output.samefile(answers):
        hint = "choose another name for the spec with -o"
        raise OutputError.because("output-exists", f"{output} holds the answers, and would be lost", hint)
    refuse_existing(output, overwrite)
    if not output.parent.is_dir():
        hint = f"make it first: mkdir -p {shlex.quote(str(output.parent))}"
        raise OutputError.because("output-not-writable", f"there is no folder {output.parent}", hint)
    said = read_answers(answers, given or [])
    brief = spread(said, sentence or None)
    terminal = sys.stdin is not None and sys.stdin.isatty() and sys.stdout.isatty()
    draft = None
    if (brief or needed_of(said.texts)) and (terminal or answers is None):
        draft, said = _asked(said, output, brief, quiet, terminal)
    if (unanswered := needed_of(said.texts)) and not said.texts:
        raise SpecError.because(
            "no-terminal",
            "there is no terminal to ask in, and no answers are given",
            "write them into a file (--answers answers.yaml), behind --answer KEY=TEXT, or as lines into a "
            f"pipe; needed are {', '.join(unanswered)}",
        )
    with said.located(), computing(output, quiet=quiet, doing="thinking"):
        from inputdesign_cli.outcome.run_directory import write_text
        from inputdesign_cli.wizard.composing import compose, with_spectrum

        if draft is None:
            if said.unclear:
                raise not_understood(*said.unclear)
            remarks = [*said.remarks, *taken_for_granted(said.texts)] if brief else said.remarks
            draft = compose(said.texts, output.stem, output.parent, remarks=remarks)
            draft.validate()
        draft = with_spectrum(draft, _result)
        write_text(output, draft.text)
    if not quiet:
        done = f"{output}: written; every line says why it stands there, and may be changed"
        typer.echo("\n".join([*draft.notes, done]))
    if solve is None and not (terminal or quiet):
        typer.echo(f"Then: idesign solve {shlex.quote(str(output))}")
    if solve or (solve is None and terminal and typer.confirm("Design the experiment now?", default=True)):
        _solve(output, draft.there, trade=trade, overwrite=overwrite, quiet=quiet)


def _solve(file: Path, there: float, *, trade: bool, overwrite: bool, quiet: bool) -> None:
    with computing(file, quiet=quiet):
        from inputdesign_cli import load_spec, questions
        from inputdesign_cli.sweeps.plan import trade_plan
        from inputdesign_cli.wizard.solving import verdict

        spec = load_spec(file)
        plan = trade_plan(file, spec, TRADED, (), None) if trade else None
        results = questions.solve(spec)
    # Specs of the same name in several folders have runs of their own.
    name = f"{file.parent.name}_{file.stem}" if file.parent.name else file.stem
    place = Place(Into(overwrite=overwrite), name, [file])
    keep(results, place, Shown(quiet=True))
    if spec.accuracy.criterion is None and "worst_ratio" in results.result.get("signal", {}):
        with computing(file, quiet=quiet, doing="what else would do"):
            found = verdict(spec, results.result, _result, there)
        if not quiet:
            lines = ["", *found, *instructions(results, str(file)), f"files: {place.directory}"]
            typer.echo("\n".join(lines))
    if plan is not None:
        from inputdesign_cli.cli.sweep import show_trade

        show_trade(plan, spec, TRADED, place.directory, Shown(quiet=quiet))


def _result(spec: Spec) -> Result:
    from inputdesign_cli import questions

    return questions.solve(spec).result


def _asked(
    said: Answers, output: Path, brief: bool, quiet: bool, terminal: bool
) -> tuple[Draft | None, Answers]:
    """Ask for a draft, again where an answer cannot be used; return it and the answers.

    Without a terminal the lines of stdin are the answers. There is no draft if they end before the questions.

    Raises:
        IdesignError: a line cannot be used.
    """
    with status("thinking ...", quiet=quiet):
        from inputdesign_cli.wizard.composing import Conversation
    talk = Conversation(
        said.texts, output.stem, output.parent, brief=brief, remarks=said.remarks, unclear=said.unclear
    )
    while (one := talk.question) is not None:
        default = one.default or ""  # shown in grey at the prompt
        asks = f"{one.asks} (Enter: {default})" if default else one.asks
        text = _typed(asks, one.allowed, default) if terminal else _piped(asks)
        if text is None:
            return None, replace(said, texts=talk.answers, remarks=talk.remarks, unclear=talk.unclear)
        with status("thinking ...", quiet=quiet):
            wrong = talk.answer(text if text.strip() else default)
        if wrong is not None and not terminal:  # the lines that follow answer other questions
            raise wrong
        if wrong is not None:
            complain(wrong)
    return talk.draft, replace(said, texts=talk.answers, places={})  # typed answers have no places


def _typed(asks: str, allowed: str, default: str) -> str:
    import questionary

    typer.echo(f"  {allowed}", err=True)
    try:
        return str(questionary.text(asks, placeholder=[("class:placeholder", default)]).unsafe_ask())
    except EOFError:  # Ctrl-D
        raise KeyboardInterrupt from None


def _piped(asks: str) -> str | None:
    """Return the next line of stdin, or None at its end."""
    line = ""
    with suppress(OSError, ValueError):  # it is closed, or no text
        line = "" if sys.stdin is None or sys.stdin.isatty() else sys.stdin.readline()
    if line:
        typer.echo(f"{asks} {line.strip()}", err=True)
    return line.strip() if line else None
