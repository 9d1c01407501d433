import numpy as np
import pytest

from inputdesign_cli.errors import SpecError
from inputdesign_cli.information.coordinates import factor_of, taking_part


def singular_space():
    """Directions (5, 2) in which p1 and p2, and p3 and p4, cannot be told apart."""
    return np.array([[1.0, -1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 2.0, 0.0]]).T


NAMES = ("p1", "p2", "p3", "p4", "p5")


def test_the_parameters_of_a_space_do_not_depend_on_the_vectors_that_span_it():
    rng = np.random.default_rng(1)
    for _ in range(20):
        turned = singular_space() @ rng.standard_normal((2, 2))
        assert taking_part(NAMES, turned) == "p1, p2, p3, p4"


def test_all_parameters_that_cannot_be_told_apart_are_named():
    rng = np.random.default_rng(2)
    null = np.linalg.qr(singular_space())[0]
    rows = rng.standard_normal((50, 5)) @ (np.eye(5) - null @ null.T)
    with pytest.raises(SpecError) as caught:
        factor_of(rows, NAMES, excitation="excitation")
    assert "p1, p2, p3, p4" in caught.value.diagnostics[0].message
    assert "p5" not in caught.value.diagnostics[0].message
