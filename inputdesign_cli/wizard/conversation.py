"""The questions one by one: an answer that cannot be used is told at once, and its question asked again."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from inputdesign_cli.errors import IdesignError, OutputError
from inputdesign_cli.wizard.composing import Draft, compose
from inputdesign_cli.wizard.plant_answer import PlantAnswer
from inputdesign_cli.wizard.plants import understand_plant
from inputdesign_cli.wizard.questions import QUESTIONS, Question, told_by_plant

# In place of what was not asked yet: it goes with every other answer.
_MEANWHILE = {
    "plant": "heater",
    "wish": "prediction within 5 % up to 1",
    "range": "plus/minus 1",
    "noise": "standard deviation 1",
}


class Conversation:
    """What was answered so far, and what is to be asked next."""

    def __init__(self, known: Mapping[str, str], stem: str, folder: Path) -> None:
        """Begin with what is known; stem and folder as of `compose`."""
        self._answers, self._stem, self._folder = dict(known), stem, folder
        self._plant: PlantAnswer | None = None
        self.draft: Draft | None = None  # of all answers, once there are all of them

    @property
    def question(self) -> Question | None:
        """The next one; None where the draft is there."""
        there = {*self._answers, *told_by_plant(self._answers)}
        return next((one for one in QUESTIONS if one.key not in there), None)

    def answer(self, text: str) -> IdesignError | None:
        """Answer the question; what is wrong, if something is: then its question comes again.

        Raises:
            OutputError: a file beside the spec cannot be written.
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
            if key not in self._answers:
                return None  # it is about what stands in for an answer
            del self._answers[key]
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
