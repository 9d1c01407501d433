"""A commented spec from answers: all at once, or question by question; `experiment.txt` has its lines."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from inputdesign_cli.errors import IdesignError, OutputError
from inputdesign_cli.outcome.results import Result
from inputdesign_cli.outcome.sentences import filled
from inputdesign_cli.outcome.shares import per_cent
from inputdesign_cli.specification import Spec, parse_spec
from inputdesign_cli.wizard import questions as asking
from inputdesign_cli.wizard.grammar import AMOUNT, Phrase, beyond_models, short
from inputdesign_cli.wizard.noise import noise_lines
from inputdesign_cli.wizard.plants import PlantAnswer, understand_plant
from inputdesign_cli.wizard.questions import KEYS, QUESTIONS, Question, bad_answer, in_their_words, question
from inputdesign_cli.wizard.sentence import Heard, in_sentence, not_understood, question_of
from inputdesign_cli.wizard.wishes import (
    Range,
    channels_of,
    controller,
    dwell,
    input_range,
    limited,
    quantisation,
    wished,
)

_MOST, LEAST = 5000, 50  # samples
_MOST_IN_LOOP = 1000  # samples if a record is fitted to its limits at many plants, each in its loop
_TYPES = {"any": "multisine", "multisine": "multisine", "two levels": "binary", "three levels": "ternary"}
_UNUSED = (
    "how well the plant is known is not used: a Bode plot is designed at the plant as stated, and another "
    "plant needs other powers"
)
# Stand-ins for answers that are not given yet; they are compatible with every answer.
_MEANWHILE = {
    "plant": "heater",
    "wish": "prediction within 5 % up to 1",
    "range": "plus/minus 1",
    "noise": "standard deviation 1",
}
# Orders of filtered noise and numbers of sinusoids that are tried, the simplest first.
_ORDERS, _LINES = (20, 40), (60, 120, 240)
_ENOUGH = 1.02  # ratio to the bound over every spectrum
_FIRST = "{type: fir, order: 20}"
_WITHOUT_MEAN = "{type: multisine, lines: 60}"  # power at frequency 0 would make an integrator diverge
_LEAST_GAP = 1e-3  # the smallest gap that is shown
_POSITIONS = 10  # the fewest positions of an input that keeps them
_PERIODS = 5  # periods of a record for a Bode plot
_BEYOND = 2.0  # a bound better by this factor ignores limits, and is not shown

_NAMED = re.compile(rf"\s*({'|'.join(KEYS)})\s*[=:]\s*(.*)", re.I | re.S)  # "time=2 h"

Solve = Callable[[Spec], Result]


@dataclass(frozen=True)
class Draft:
    """Holds a spec as facts for its template, and the files next to it."""

    facts: Mapping[str, object]  # facts of the template, by name
    files: Mapping[str, bytes]
    spectrum: str | None  # its text in the spec; None if the accuracy states the lines
    folder: Path
    said: Mapping[str, str]  # the answers
    there: float  # the time available
    notes: tuple[str, ...] = ()  # remarks on the plant for the user, a sentence each
    why: str = "filtered noise"  # the comment on the spectrum

    @property
    def text(self) -> str:
        """Return the text of the spec."""
        known = {**self.facts, "spectrum": self.spectrum, "why": self.why}
        return filled("inputdesign_cli.wizard", "experiment.txt", known)

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


def compose(
    answers: Mapping[str, str],
    stem: str,
    folder: Path,
    plant: PlantAnswer | None = None,
    remarks: Sequence[str] = (),
) -> Draft:
    """Return the spec that follows from the answers.

    Args:
        stem: the stem of the name of the spec.
        folder: the folder of the spec; names of files are relative to it.
        plant: the plant of the answers, if it is understood already.
        remarks: remarks on parts of a sentence that answer no question.

    Raises:
        SpecError: `bad-answer`.
        DataError: a file cannot be used.
    """
    said = asking.complete(answers)
    plant = (plant or understand_plant(said["plant"], stem, folder)).sampled_for(said["wish"])
    span, there = input_range(said["range"], plant), Phrase(said["time"], "time", plant.clock).lasting()
    step, why = plant.sample_time, _reason_of_sampling(plant, there)
    hold = dwell(said["hold"], plant)
    control = controller(said["loop"], plant, keeps=hold > 1)
    most = _MOST_IN_LOOP if plant.vague and control is not None else _MOST
    asked = wished(said["wish"], plant, control is not None, min(there, most * step))
    nonparametric = any("frequency_response" in line for line in asked)
    rate, output = limited(said["limits"], plant)
    unused, wanders = nonparametric and plant.vague, plant.integrates and control is None
    heard = [*plant.heard, *remarks, *beyond_models(", ".join(said.values()))]
    duration = _duration(there, most * step, step, hold, nonparametric=nonparametric)
    heard += [*_of_controller(plant, control, said["loop"], hold), *_of_length(plant, duration, there, most)]
    facts = {
        "said": said,
        "plant": plant,
        "heard": heard,
        "why_sampling": why,
        "noise": noise_lines(said["noise"], said["drift"], folder, plant),
        "unused": _UNUSED * unused,
        "controller": control,
        "asked": asked,
        "span": span,
        "points": _points(span),
        "rate": rate,
        "output": output,
        "looped": plant.vague and control is not None and not nonparametric,
        "duration": duration,
        "periods": _PERIODS,
        "there": there,
        "most": most,
        "made": _made(said["signals"], hold if control is None and not (nonparametric or wanders) else 1),
        "converter": quantisation(said["converter"], span),
        "hold": hold,
        "returns": asking.chosen("return", said["return"], {"yes": True, "no": False}),
        "channels": channels_of(said, plant, span),
    }
    notes = (*heard, *plant.doubts, *[_UNUSED] * unused)
    first = None if nonparametric else _WITHOUT_MEAN if wanders else _FIRST
    return Draft(facts, plant.files, first, folder, said, there, notes)


def _made(said: str, hold: int) -> str:
    """Return the kind of signal: held positions give more information at two levels."""
    kind = asking.chosen("signals", said, _TYPES)
    return "binary" if kind == "multisine" and hold > 1 else kind


def _reason_of_sampling(plant: PlantAnswer, there: float) -> str:
    """Return why the sample time is as it is; raise `bad-answer` if the time holds too few samples."""
    step, unit, why = short(plant.sample_time), plant.time_unit, plant.why_sampling
    if plant.sampling is None:
        why = f"a twentieth of the time constant of {short(plant.slow)} {unit}, rounded down"
    if there < LEAST * plant.sample_time:
        few = f"{short(there)} {unit} are less than {LEAST} samples, one every {step} {unit}"
        least = short(LEAST * plant.sample_time)
        raise bad_answer("time", f"{few} ({why}); {least} {unit} are needed at least")
    return why


def _of_controller(plant: PlantAnswer, control: str | None, said: str, hold: int) -> list[str]:
    """Return remarks on defaults: the controller, or none, and held values of r under a controller."""
    if control is None:
        why = ", as the actuator keeps its positions" * (hold > 1)
        remark = (
            f"the plant integrates and is played in open loop{why}: its output wanders as "
            "predicted_output.csv shows. If that is too far, say how far it may go (limits: output 5), or "
            "name the controller that runs (loop: PI Kp 1, Ti 60)"
        )
        return [remark] * (plant.integrates and said.lower() == "as the plant")
    unasked = "slope" in plant.values and said.lower() == "as the plant"
    taken = f"a plant that integrates runs under a controller; {control} is taken: name yours (loop)"
    held = "under a controller r keeps its values, and the actuator still moves at every sample"
    return [taken] * unasked + [held] * (hold > 1)


def _points(span: Range) -> str:
    """Return the comment that per cents of a range refer to the actuator, not to the middle of the range."""
    low, high = (short(span.offset + side * span.amplitude) for side in (-1, 1))
    percent = span.unit == "%" and span.offset
    middle = short(span.offset)
    return f"  # from {low} to {high} %: points of the range, not per cent of {middle}" if percent else ""


def _of_length(plant: PlantAnswer, duration: float, there: float, most: int) -> list[str]:
    """Return a remark on a record that does not use all the time available, since it has `most` samples."""
    whole = f"{short(duration)} of the {short(there)} {plant.time_unit} that there are"
    shorter = there > most * plant.sample_time and duration < there
    return [f"the record takes {whole}: a design of more than {most} samples takes long"] * shorter


def _duration(there: float, most: float, step: float, hold: int, *, nonparametric: bool) -> float:
    """Return the length of a record in whole positions of the input, each of `hold` samples."""
    # The lines of a response lie one over the duration apart, so that it uses all the time.
    most = there if nonparametric else min(there, most)
    if hold == 1:
        return most
    whole = hold * step * (_PERIODS if nonparametric else 1)
    if most < _POSITIONS * whole:
        raise bad_answer("hold", f"in the time that there is, the input has less than {_POSITIONS} positions")
    return whole * math.floor(most / whole * (1.0 + 1e-9))


def with_spectrum(draft: Draft, solve: Solve) -> Draft:
    """Return the draft with the simplest spectrum that is within 2 % of every other at the plant as stated.

    If there is none, the draft gets the simplest of the best. A dead time one period longer would explain a
    periodic record nearly as well. Filtered noise has power between the lines of a multisine, so that its
    record is not periodic. A record that leaves other dead times open is taken only if all do.

    Raises:
        IdesignError: nothing can be designed; the error is in words of the answers.
    """
    if draft.spectrum is None:
        return draft
    tried: list[tuple[Draft, float, float, bool]] = []
    most = max(draft.spec().experiment.samples // 2, 1)
    lines = [min(_LINES[0], most), *(number for number in _LINES[1:] if number <= most)]
    # Each spectrum as text of a spec and of a comment.
    orders = _ORDERS if draft.spectrum == _FIRST else ()
    spectra = [(f"{{type: fir, order: {n}}}", f"filtered noise of order {n}") for n in orders]
    spectra += [(f"{{type: multisine, lines: {n}}}", f"{n} sinusoids") for n in lines]
    for words, what in spectra:
        one = replace(draft, spectrum=words, why=what)
        with in_their_words(draft.said):
            at_one = {"uncertainty": None, "signal.candidates": 1, "solver.any_spectrum": True}
            result = solve(one.spec().with_(**at_one))
        value, bound = (float(result["objective"].get(key) or 0.0) for key in ("value", "any_spectrum_bound"))
        rivals = bool(result.get("foreseen", {}).get("rivals"))
        tried.append((one, value, bound, rivals))
        if value <= _ENOUGH * bound and not rivals:
            break
    clear = [one for one in tried if not one[3]] or tried
    least = min(value for _, value, *_ in clear)
    best, value, bound, _ = next(one for one in clear if one[1] <= _ENOUGH * least)
    closer = "better ones leave other dead times open" * (value > _ENOUGH * min(one[1] for one in tried))
    comment = closer or "longer ones are no better, as far as was tried"
    if value <= _BEYOND * bound:
        gap = per_cent(max(value / bound - 1.0, _LEAST_GAP), 2)
        comment = "; ".join(filter(None, (f"at the plant above no spectrum gains more than {gap}", closer)))
    return replace(best, why=f"{best.why}: {comment}")


class Conversation:
    """Asks questions one by one: an answer that cannot be used is refused at once, and asked for again.

    The first answer may be a sentence that answers several questions. Then its parts that are not understood
    are asked for in other words, and after them the other questions, and three about the actuator. An answer
    that names its question, as in "time=2 h", may come at any time.
    """

    def __init__(
        self,
        known: Mapping[str, str],
        stem: str,
        folder: Path,
        *,
        brief: bool = False,
        remarks: Sequence[str] = (),
        unclear: Sequence[str] = (),
    ) -> None:
        """Begin with the answers that are known, from a sentence if `brief`; the rest is as for `compose`."""
        self.answers, self._stem, self._folder = dict(known), stem, folder
        self.remarks, self.unclear = list(remarks), list(unclear)
        self._plant: PlantAnswer | None = None
        self._brief = brief
        self._refused: dict[str, str] = {}  # a refused answer on the plant, which may lack a quantity
        self.draft: Draft | None = None  # the draft of all answers, once they are given

    @property
    def question(self) -> Question | None:
        """Return the next question; None if all are answered."""
        if self.unclear:
            return asking.in_other_words(self.unclear[0])
        there = {*self.answers, *asking.known_from(self.answers)}
        left = (one for one in QUESTIONS if one.key not in there)
        return next((one for one in left if not self._brief or one.unsaid or one.default is None), None)

    def answer(self, text: str) -> IdesignError | None:
        """Answer the question, and return the error of an answer, whose question then comes again.

        The next answer may then complete one that was refused.

        Raises:
            OutputError: a file next to the spec cannot be written.
        """
        asked = self.question
        assert asked is not None
        named = _NAMED.match(text)
        key, text = (named[1].lower(), named[2]) if named else (asked.key, text)
        try:
            if asked.key == asking.UNCLEAR:
                return self._in_other_words(text, key, asked)
            heard = in_sentence(text, least=1) if key == "plant" else Heard({})
            if len(heard.answers) == 1 and key not in heard.answers:
                heard = Heard({})  # the answer to another question
        except IdesignError as refusal:
            return refusal
        self._brief = self._brief or bool(heard.answers.keys() - {"plant"})
        self.remarks += heard.remarks
        self.unclear += heard.unclear
        before = self._refused.get(key)
        error = self._added(heard.answers or {key: text})
        if error is None or (before and self._added({key: f"{before}, {text}"}) is None) or heard.unclear:
            return None  # the part that is not understood may hold the missing quantity
        meant = question_of(text)
        if heard.answers or error.diagnostics[0].key != key or named or meant in (None, key):
            return error
        hint = f'to answer "{question(meant or key).asks}" write {meant}={text}'
        return type(error)([replace(one, hint=f"{hint}; {one.hint}") for one in error.diagnostics])

    def _in_other_words(self, text: str, key: str, asked: Question) -> IdesignError | None:
        """Add the answer to the part that was not understood, or leave that out with a remark.

        Args:
            key: the key of the question that the answer names, or else of the one that is asked.

        Raises:
            SpecError: `bad-answer`, it is not understood either.
        """
        kept, parts, refused = dict(self.answers), list(self.unclear), self._refused
        earlier = refused | kept
        if text == asked.default:
            heard = Heard({}, (f"left out: {parts[0]}",))
        elif key != asked.key:
            heard = Heard({key: text})
        elif not (heard := in_sentence(text, least=1)).answers:
            raise not_understood(text)
        said = dict(heard.answers)
        joined = {one: ", ".join(filter(None, (earlier.get(one), text))) for one, text in said.items()}
        error = None
        # The answer is joined to the earlier one, or else replaces it.
        bare = re.fullmatch(rf"\s*{AMOUNT}\s*", text, re.I) is not None  # a time may answer several questions
        for more in (said,) if key != asked.key else (joined,) if bare else (joined, said):
            self.answers, self.unclear, self._refused = dict(kept), [*heard.unclear, *parts[1:]], refused
            error = self._added(more if self.unclear else earlier | more)
            if error is None or error.diagnostics[0].key not in more:
                break
        else:
            self.answers, self.unclear, self._refused = kept, parts, refused
            return error
        self.remarks += heard.remarks
        return None if self.unclear else error

    def _added(self, answers: Mapping[str, str]) -> IdesignError | None:
        """Add answers; return the error of one that cannot be used, which is removed again."""
        self.answers |= answers
        try:
            # The plant, which may be a log to be explored, is read once only.
            self._plant = None if "plant" in answers else self._plant
            if self._plant is None and (plant := self.answers.get("plant", "").strip()):
                self._plant = understand_plant(plant, self._stem, self._folder)
            said = {**_MEANWHILE, **asking.known_from(self.answers), **self.answers}
            draft = compose(said, self._stem, self._folder, self._plant, self.remarks)
            if self.question is None:
                draft.validate()
                self.draft = draft
        except OutputError:
            raise  # no other answer helps
        except IdesignError as error:
            wrong = error.diagnostics[0].key
            if (refused := self.answers.pop(wrong, None)) is None:
                return None  # the error is about a stand-in
            if wrong == "plant":
                self._plant, self._refused = None, {wrong: refused}
            return error
        self._refused = {} if "plant" in answers else self._refused
        return None
