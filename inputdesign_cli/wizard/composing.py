"""A commented spec from answers: all at once, or question by question."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from inputdesign_cli.errors import IdesignError, OutputError
from inputdesign_cli.specification import Spec, parse_spec
from inputdesign_cli.wizard.faults import in_their_words
from inputdesign_cli.wizard.grammar import seconds, sensible, short
from inputdesign_cli.wizard.means import input_range, limit_lines, limited, loop_line, signal_lines
from inputdesign_cli.wizard.noise import noise_lines
from inputdesign_cli.wizard.plants import understand_plant
from inputdesign_cli.wizard.questions import QUESTIONS, Question, bad_answer, complete, known_from
from inputdesign_cli.wizard.stated_plants import PlantAnswer
from inputdesign_cli.wizard.wishes import wished

_MOST, LEAST = 5000, 50  # samples
_UNUSED = (
    "how well the plant is known is not used: a Bode plot is designed at the plant as stated, and another "
    "plant needs other powers"
)
_DRAWN = (
    "  scenarios: 30  # what is asked holds at all of these plants, drawn from that",
    "  worst_case: 0.95  # and at the worst ones that a search finds there",  # in intervals: everywhere
    "  fresh: 200",
)
# Answers that go with every other, in place of answers that are not asked for yet.
_MEANWHILE = {
    "plant": "heater",
    "wish": "prediction within 5 % up to 1",
    "range": "plus/minus 1",
    "noise": "standard deviation 1",
}


@dataclass(frozen=True)
class Draft:
    """A spec in parts, and the files next to it.

    Args:
        heads: the lines before the spectrum.
        tails: the lines behind it.
        spectrum: as in a spec; None if the accuracy has the lines.
        said: the answers.
        there: seconds that may be taken.
        notes: what the user must know of the plant, a sentence each.
        why: the comment on the spectrum.
    """

    heads: tuple[str, ...]
    tails: tuple[str, ...]
    files: Mapping[str, bytes]
    spectrum: str | None
    folder: Path
    said: Mapping[str, str]
    there: float
    notes: tuple[str, ...] = ()
    why: str = "filtered noise"

    @property
    def text(self) -> str:
        """The spec."""
        spectrum = () if self.spectrum is None else (f"spectrum: {self.spectrum}  # {self.why}",)
        return "\n".join([*self.heads, *spectrum, *self.tails]) + "\n"

    def spec(self) -> Spec:
        """Return the spec, checked; the files next to it must have been written.

        Raises:
            SpecError: the answers make no spec.
        """
        with in_their_words(self.said):
            return parse_spec(self.text, "<answers>", folder=self.folder)

    def validate(self) -> None:
        """Write the files next to the spec, and check that it is well posed.

        Raises:
            IdesignError: as `questions.validate` does, or a file cannot be written.
        """
        from inputdesign_cli import questions
        from inputdesign_cli.outcome.run_directory import write_bytes

        for name, content in self.files.items():
            write_bytes(self.folder / name, content)
        with in_their_words(self.said):
            questions.validate(self.spec())


def compose(answers: Mapping[str, str], stem: str, folder: Path, plant: PlantAnswer | None = None) -> Draft:
    """Return the spec of the answers.

    Args:
        stem: of the name of the spec.
        folder: of the spec; names of files are relative to it.
        plant: what is known of it, if that is understood already.

    Raises:
        SpecError: `bad-answer`.
        DataError: a file cannot be used.
    """
    said = {key: sensible(text, key) for key, text in complete(answers).items()}
    span, there = input_range(said["range"]), seconds(said["time"], "time")
    plant = plant or understand_plant(said["plant"], stem, folder)
    step = plant.sample_time
    if there < LEAST * step:
        why = "a twentieth of the time constant" if plant.sampling is None else plant.why_sampling
        why = f"{short(there)} s are less than {LEAST} samples, one every {short(step)} s ({why})"
        raise bad_answer("time", why)
    duration = min(there, _MOST * step)
    controller = loop_line(said["loop"], plant)
    asked = wished(said["wish"], plant, controller is not None, duration)
    # Lines of a response are one over the time apart: it takes all of it.
    nonparametric = any("frequency_response" in line for line in asked)
    limits = limit_lines(span, said["limits"], there if nonparametric else duration, step)
    if duration < there and not nonparametric:
        limits[-1] += f": {_MOST} samples to begin with; up to {short(there)} may be taken"
    known = _uncertain(plant)
    unused = [_UNUSED] if nonparametric and known else []
    loop = ["experiment:", f"  controller: {controller}  # u = r - C y; r is designed"]
    heads = [
        "# Written by `idesign wizard`: every line follows from an answer. Change what you know better.",
        f"title: {json.dumps(said['wish'], ensure_ascii=False)}",
        *_head(plant),
        *(f"# against this model: {one}" for one in plant.against),
        *noise_lines(said["noise"], said["drift"], folder, plant),
        *([f"# {one}" for one in unused] or known),
        *([] if controller is None else loop),
        *asked,
        "objective: best_accuracy  # use all that is allowed",
        *limits,
    ]
    fitted = limited(said["limits"])[1] is not None
    tails = signal_lines(said["signals"], said["converter"], span, fitted=fitted)
    tails += ["  periods: 5"] if nonparametric else []  # equal ones, of which the first is transient
    return Draft(
        tuple(heads),
        tuple(tails),
        plant.files,
        None if nonparametric else "{type: fir, order: 20}",
        folder,
        said,
        there,
        (*(f"against the model of {plant.source}: {one}" for one in plant.against), *unused),
    )


def _head(plant: PlantAnswer) -> list[str]:
    """Return the lines of the clock and the plant; a file that is included has the clock."""
    if plant.explored is not None:
        return [*plant.lines]
    why = plant.why_sampling
    if plant.sampling is None:
        why = f"a twentieth of the time constant of {short(plant.slow)} s, or a little less"
    return [f"sample_time: {short(plant.sample_time)}  # {why}", "time_unit: s", *plant.lines]


def _uncertain(plant: PlantAnswer) -> list[str]:
    """Return the lines of `uncertainty`, if something is said of it."""
    if plant.covariance is not None:
        return ["uncertainty:", f"  covariance: {plant.covariance}", *_DRAWN]
    if not plant.intervals:
        return []
    listed = [f"    {name}: [{short(low)}, {short(high)}]" for name, (low, high) in plant.intervals.items()]
    return ["uncertainty:  # how well it is known", "  intervals:", *listed, *_DRAWN]


class Conversation:
    """Questions one by one: an answer that cannot be used is refused at once, and asked for again."""

    def __init__(self, known: Mapping[str, str], stem: str, folder: Path) -> None:
        """Begin with what is known; stem and folder as of `compose`."""
        self._answers, self._stem, self._folder = dict(known), stem, folder
        self._plant: PlantAnswer | None = None
        self.draft: Draft | None = None  # of all answers, once they are there

    @property
    def question(self) -> Question | None:
        """The next question, or None."""
        there = {*self._answers, *known_from(self._answers)}
        return next((one for one in QUESTIONS if one.key not in there), None)

    def answer(self, text: str) -> IdesignError | None:
        """Answer the question, and return what is wrong: then the question that it is about comes again.

        Raises:
            OutputError: a file next to the spec cannot be written.
        """
        asked = self.question
        assert asked is not None
        self._answers[asked.key] = text
        try:
            self._understand()
        except OutputError:
            raise  # no answer can help
        except IdesignError as error:
            key = error.diagnostics[0].key
            if self._answers.pop(key, None) is None:
                return None  # it is about what stands in for an answer
            if key == "plant":
                self._plant = None
            return error
        return None

    def _understand(self) -> None:
        """Try the answers; the plant, which may be a log to be explored, is understood once."""
        if self._plant is None and self._answers["plant"].strip():
            self._plant = understand_plant(self._answers["plant"].strip(), self._stem, self._folder)
        draft = compose({**_MEANWHILE, **self._answers}, self._stem, self._folder, self._plant)
        if self.question is None:
            draft.validate()
            self.draft = draft
