"""`idesign wizard`: questions in the user's words, a commented spec, and what it comes to."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from inputdesign_cli.cli.options import TRADED, Changes, Into, Shown, refuse_existing
from inputdesign_cli.cli.run import Place, keep
from inputdesign_cli.cli.terminal import complain, computing, status
from inputdesign_cli.errors import OutputError, SpecError

if TYPE_CHECKING:
    from inputdesign_cli.outcome.results import Result
    from inputdesign_cli.specification import Spec
    from inputdesign_cli.wizard.composing import Draft
    from inputdesign_cli.wizard.questions import Question


def wizard(
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

    At most ten questions: the plant, what the model is for, what the experiment may use, the noise.
    They are asked in the terminal where no option answers them. What is written is an ordinary spec.
    """
    from inputdesign_cli.wizard.questions import Answers, needed_of, read_answers

    _check_place(output, answers, overwrite)
    said = read_answers(answers, given or [])
    terminal = sys.stdin is not None and sys.stdin.isatty() and sys.stdout.isatty()
    draft, known = None, said.texts
    unanswered = needed_of(known)
    if unanswered and terminal:
        draft, said = _asked(known, output, quiet), Answers()  # what is typed stands in no file
    elif unanswered and not known:
        _refuse(unanswered)
    with said.located(), computing(output, quiet=quiet, doing="thinking"):
        from inputdesign_cli.outcome.run_directory import write_text
        from inputdesign_cli.wizard.composing import compose, with_spectrum

        if draft is None:
            draft = compose(known, output.stem, output.parent)
            draft.validate()
        draft = with_spectrum(draft, _result)
        write_text(output, draft.text)
    if not quiet:
        done = f"{output}: written; every line says why it stands there, and may be changed"
        typer.echo("\n".join([*draft.notes, done]))
    if solve or (solve is None and terminal and typer.confirm("Design the experiment now?", default=True)):
        _solve(output, draft.there, trade=trade, overwrite=overwrite, quiet=quiet)


def _check_place(output: Path, answers: Path | None, overwrite: bool) -> None:
    """Check that the spec may be written.

    Raises:
        OutputError: `output-exists`.
    """
    if answers is not None and output.exists() and output.samefile(answers):
        hint = "choose another name for the spec with -o"
        raise OutputError.because("output-exists", f"{output} holds the answers, and would be lost", hint)
    refuse_existing(output, overwrite)


def _solve(file: Path, there: float, *, trade: bool, overwrite: bool, quiet: bool) -> None:
    with computing(file, quiet=quiet):
        from inputdesign_cli import load_spec, questions
        from inputdesign_cli.wizard.solving import to_log, verdict

        spec = load_spec(file)
        results = questions.solve(spec)
    place = Place(Into(overwrite=overwrite), file.stem, [file])
    keep(results, place, Shown(quiet=True))
    if spec.accuracy.criterion is None and "worst_ratio" in results.result.get("signal", {}):
        with computing(file, quiet=quiet, doing="what else would do"):
            found = verdict(spec, results.result, _result, there)
        if not quiet:
            lines = ["", *found, *to_log(spec, results, str(file)), f"files: {place.directory}"]
            typer.echo("\n".join(lines))
    if trade:
        from inputdesign_cli.cli.sweep import show_trade

        show_trade(file, spec, TRADED, place.directory, Changes(), Shown(quiet=quiet))


def _result(spec: Spec) -> Result:
    from inputdesign_cli import questions

    return questions.solve(spec).result


def _asked(known: dict[str, str], output: Path, quiet: bool) -> Draft:
    """Ask for a draft at the terminal, again where an answer cannot be used."""
    with status("thinking ...", quiet=quiet):
        from inputdesign_cli.wizard.composing import Conversation
    talk = Conversation(known, output.stem, output.parent)
    while (one := talk.question) is not None:
        typer.echo(f"  {one.allowed}", err=True)
        text = _typed(one)
        with status("thinking ...", quiet=quiet):
            wrong = talk.answer(text)
        if wrong is not None:
            complain(wrong)
    assert talk.draft is not None
    return talk.draft


def _typed(one: Question) -> str:
    """Return what is typed at the prompt of a question; its default stands there in grey before."""
    import questionary

    default = one.default or ""
    asks = f"{one.asks} (Enter: {default})" if default else one.asks
    try:
        text: str = questionary.text(asks, placeholder=[("class:placeholder", default)]).unsafe_ask()
    except EOFError:  # Ctrl-D
        raise KeyboardInterrupt from None
    return text if text.strip() else default


def _refuse(unanswered: list[str]) -> None:
    raise SpecError.because(
        "no-terminal",
        "there is no terminal to ask in, and no answers are given",
        "write them into a file (--answers answers.yaml) or behind --answer KEY=TEXT; needed are "
        f"{', '.join(unanswered)}",
    )
