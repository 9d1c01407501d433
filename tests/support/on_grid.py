"""A requirement that looks at a grid of frequencies alone, as programs of the literature do."""

import numpy as np

from inputdesign_cli.accuracy import Cut, Requirement, Violation


class OnGrid(Requirement):
    """`whole` at these frequencies, the worst `most` of them at a time."""

    def __init__(self, whole: Requirement, grid: np.ndarray, most: int | None = None):
        self.whole, self.grid, self.most = whole, grid, most

    @property
    def name(self) -> str:
        return "on a grid"

    def violations(self, information, *, above: float = -np.inf) -> list[Violation]:
        found = self.ratios(information, self.grid)
        worst = np.argsort(-found)[: self.most]
        return [Violation(float(found[i]), float(self.grid[i])) for i in worst if found[i] > above]

    def ratios(self, information, frequencies) -> np.ndarray:
        return self.whole.ratios(information, frequencies)

    def cut(self, frequency: float | None) -> Cut:
        return self.whole.cut(frequency)
