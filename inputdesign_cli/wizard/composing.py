"""Answers -> a commented spec."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from inputdesign_cli.specification import Spec, parse_spec
from inputdesign_cli.wizard.faults import in_their_words
from inputdesign_cli.wizard.log_noise import log_noise_lines
from inputdesign_cli.wizard.means import input_range, limit_lines, loop_line, noise_lines, signal_lines
from inputdesign_cli.wizard.phrases import seconds, short, with_plain_numbers
from inputdesign_cli.wizard.plant_answer import PlantAnswer
from inputdesign_cli.wizard.plants import understand_plant
from inputdesign_cli.wizard.questions import bad_answer, complete
from inputdesign_cli.wizard.wishes import wished

_MOST, LEAST = 5000, 50  # samples
_PLANTS, _FRESH = 30, 200
_REACH = 0.95  # of an ellipsoid, in which the worst plants are sought; of intervals it is all
_UNUSED = (
    "how well the plant is known is not used: a Bode plot is designed at the plant as stated, and one that "
    "is another needs other powers"
)
_FIRST = "{type: fir, order: 20}"


@dataclass(frozen=True)
class Draft:
    """A spec in parts, and the files that stand beside it.

    Args:
        heads: what stands before the spectrum, tails behind it.
        spectrum: as in a spec; None where the accuracy tells it.
        said: the answers.
        there: seconds that may be taken.
        told: what is to be known of the plant that was understood, a sentence each.
        why: the comment on the spectrum.
    """

    heads: tuple[str, ...]
    tails: tuple[str, ...]
    files: Mapping[str, bytes]
    spectrum: str | None
    folder: Path
    said: Mapping[str, str]
    there: float
    told: tuple[str, ...] = ()
    why: str = "filtered noise"

    @property
    def chooses(self) -> bool:
        """Whether the spectrum is to be chosen."""
        return self.spectrum is not None

    @property
    def text(self) -> str:
        """The spec."""
        spectrum = () if self.spectrum is None else (f"spectrum: {self.spectrum}  # {self.why}",)
        return "\n".join([*self.heads, *spectrum, *self.tails]) + "\n"

    def with_spectrum(self, spectrum: str, why: str) -> Draft:
        """The same with another one."""
        return replace(self, spectrum=spectrum, why=why)

    def spec(self) -> Spec:
        """The spec, checked; the files beside it must have been written.

        Raises:
            SpecError: the answers make no spec.
        """
        with in_their_words(self.said):
            return parse_spec(self.text, "<answers>", folder=self.folder)

    def validate(self) -> None:
        """Write the files that stand beside the spec, and try whether it is well posed.

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
    """The spec of the answers.

    Args:
        stem: of the name of the spec.
        folder: where it is to stand, and what names of files are relative to.
        plant: what is known of it, where that was understood before.

    Raises:
        SpecError: `bad-answer`.
        DataError: a file cannot be used.
    """
    said = {key: with_plain_numbers(text, key) for key, text in complete(answers).items()}
    span, there = input_range(said["range"]), seconds(said["time"], "time")
    plant = plant or understand_plant(said["plant"], stem, folder)
    step = plant.sample_time
    if there < LEAST * step:
        why = "a twentieth of the time constant" if plant.sampling is None else plant.why_sampling
        told = f"{short(there)} s are less than {LEAST} samples, one every {short(step)} s ({why})"
        raise bad_answer("time", told)
    duration = min(there, _MOST * step)
    controller = loop_line(said["loop"], plant)
    asked = wished(said["wish"], plant, controller is not None, duration)
    nonparametric = any("frequency_response" in line for line in asked)
    if nonparametric:  # its lines are as far apart as one over the time
        duration = there
    heads = [
        "# Written by `idesign wizard`: every line follows from an answer. Change what you know better.",
        f"title: {_quoted(said['wish'])}",
        f"sample_time: {short(step)}  # {_why_step(plant)}",
        "time_unit: s",
        *plant.lines,
        *(f"# against this model: {one}" for one in plant.against),
    ]
    if plant.explored is None:
        heads += noise_lines(said["noise"], said["drift"], folder, step)
    else:
        heads[2:4] = []  # the included file has them
        heads += log_noise_lines(plant.explored, plant.source, said["noise"], said["drift"], folder)
    heads += _uncertain(plant, nonparametric)
    if controller is not None:
        heads += ["experiment:", f"  controller: {controller}  # u = r - C y; r is designed"]
    heads += [*asked, "objective: best_accuracy  # use all that is allowed"]
    heads += limit_lines(span, said["limits"], duration, step)
    if duration < there:
        heads[-1] += f": {_MOST} samples to begin with; up to {short(there)} may be taken"
    notes = tuple(f"against the model of {plant.source}: {one}" for one in plant.against)
    if nonparametric and (plant.covariance or plant.intervals):
        notes += (_UNUSED,)
    tails = signal_lines(said["signals"], said["converter"], span, said["limits"])
    if nonparametric:
        return Draft(tuple(heads), tuple(_periodic(tails)), plant.files, None, folder, said, there, notes)
    return Draft(tuple(heads), tuple(tails), plant.files, _FIRST, folder, said, there, notes)


def _why_step(plant: PlantAnswer) -> str:
    if plant.sampling is not None:
        return plant.why_sampling
    return f"a twentieth of the time constant of {short(plant.slow)} s, or a little less"


def _uncertain(plant: PlantAnswer, nonparametric: bool) -> list[str]:
    """How well the plant is known, where that is said and a design can heed it."""
    if not (plant.covariance or plant.intervals):
        return []
    if nonparametric:
        return [f"# {_UNUSED}"]
    drawn = (
        f"  scenarios: {_PLANTS}  # what is asked holds at so many plants drawn from that",
        f"  worst_case: {_REACH}  # and at the worst ones that a search finds there",
        f"  fresh: {_FRESH}",
    )
    if plant.covariance is not None:
        return ["uncertainty:", f"  covariance: {plant.covariance}", *drawn]
    listed = [f"    {name}: [{short(low)}, {short(high)}]" for name, (low, high) in plant.intervals.items()]
    return ["uncertainty:  # how well it is known", "  intervals:", *listed, *drawn]


def _periodic(tails: list[str]) -> list[str]:
    """A frequency response takes equal periods, of which the first is left to the transient."""
    return [*tails, "  periods: 5"]


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
