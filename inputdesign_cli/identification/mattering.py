"""Select the parameters that a model lacks and that speak against its accuracy: |error of G| <= r_adm.

It is neither enough nor necessary that the parameter is beyond chance. The odds count that it exists and that
G is beyond r_adm, after the estimated move and with its uncertainty. The evidence for the parameter is the
Bayes factor of a normal estimate ([kass-raftery-1995]). A priori the parameter is normal about zero, of a
size that moves G by about r_adm.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.directed import Directed
from inputdesign_cli.levels import level

# The odds from which nothing is promised any more.
_ODDS = 0.7
# Odds beforehand that something is missing, shared among the parameters that stand for it: what plants mostly
# have beyond their model is a lag or a longer dead time.
_OF_LAGS, _OF_OTHERS = 1.0, 0.2
_LEAST = 1e-300


@dataclass(frozen=True)
class Moves:
    """What a parameter more does to G at n frequencies, in units of the admissible error.

    Attributes:
        estimated: (n,), how far G moves if the parameter is estimated along.
        deviation: (n,), the standard deviation of that.
        known: (n,), the largest standard deviation of G of the model itself.
    """

    estimated: Array
    deviation: Array
    known: Array

    @property
    def largest(self) -> float:
        """Return the largest estimated move of G."""
        return float(np.max(self.estimated))

    def odds(self, probability: float) -> float:
        """Return the odds that the parameter exists and G exceeds the admissible error, from even prior odds.

        Args:
            probability: of an estimate as far from zero, if the parameter is not there.
        """
        reach = float(np.max(self.deviation))
        if reach == 0.0:
            return 0.0
        left = 1.0 / (1.0 + reach**2)  # of the estimate, once the prior draws it to zero
        statistic = float(scipy.special.chdtri(1.0, max(probability, _LEAST)))
        evidence = np.exp(0.5 * (np.log1p(-left) + left * statistic))
        spread = np.sqrt(self.known**2 + left * self.deviation**2)
        beyond = sum(
            scipy.special.ndtr((sign * left * self.estimated - 1.0) / np.maximum(spread, _LEAST))
            for sign in (1.0, -1.0)
        )
        return float(evidence * np.max(beyond))


def that_matter(tried: Sequence[Directed], moves: Sequence[Moves]) -> list[int]:
    """Return the indices of the parameters that speak against a verdict."""
    # A gain that varies often has a large effect that the record hardly shows: it matters where it would move
    # G by more than is admitted, at a level that is shared among all that would. What is not a number is no
    # promise: it is compared so that it speaks against one.
    varying = [i for i, one in enumerate(tried) if not (one.of_structure or moves[i].largest <= 1.0)]
    found = [i for i in varying if not tried[i].test.probability * len(varying) >= level("varying gain")]
    structure = [i for i, one in enumerate(tried) if one.of_structure]
    among = Counter(tried[i].lag for i in structure)
    for i in structure:
        beforehand = (_OF_LAGS if tried[i].lag else _OF_OTHERS) / among[tried[i].lag]
        if not beforehand * moves[i].odds(tried[i].test.probability) <= _ODDS:
            found.append(i)
    return sorted(found)
