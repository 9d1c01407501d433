"""What is refused of specs with several channels and in continuous time, with place and hint."""

import pytest

from inputdesign_cli import validate
from inputdesign_cli.errors import EXIT_BAD_INPUT, SpecError
from tests.support.matrix_specs import CONTINUOUS, changed

BAD = {
    "improper": (
        "plant.continuous.numerator=[[[1, 0, 0, 3.1], [3.2]], [[5.3], [1.6]]]",
        "improper-transfer",
        "not proper",
    ),
    "unstable": (
        "plant.continuous.denominator=[[[1, -1.5, 1.6], [1, 2, 1.1]], [[1, 0.5, 1.1], [1, 1, 0.3]]]",
        "unstable-polynomial",
        "",
    ),
    "zero width": ("spectrum.band=[2, 2]", "bad-band", ""),
    "zero limit": ("limits.input_power=0", "out-of-range", ""),
    "contradictory": ("limits.input_power={min: 20, max: 10}", "conflicting-keys", "larger than max"),
    "no band": ("spectrum={type: free}", "needs-band", "frequencies have no end"),
    "indistinguishable": (
        "plant.continuous={numerator: [[[1, 1], [1]]], denominator: [[[1, 2, 1], [1, 1]]]}",
        "not-identifiable",
        r"no excitation within the band can tell these parameters apart: b0\[1,1\], a0\[1,1\], a1\[1,1\]",
    ),
    "too slow": ("sample_time=4", "beyond-nyquist", "cannot carry the band"),
    "band beyond the limit": ("limits.band=[0, 1]", "bad-limit", r"leaves limits.band"),
    "sensitivity": (
        "accuracy={model_error: {sensitivity: {max_db: 6, controller: {numerator: [0.1]}}}}",
        "unsuitable-key",
        "works in discrete time, but the plant is not sampled",
    ),
    "levels in continuous time": ("signal.type=binary", "not-supported", "has no levels"),
    "hold in continuous time": ("signal.hold=2", "not-supported", "holds nothing"),
    "columns without a criterion": (
        "accuracy={standard_deviation: {'b0[1,1]': 0.1}}",
        "not-supported",
        "factor_columns is for a criterion",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_refused_with_place_and_hint(name):
    override, code, message = BAD[name]
    extra = ["spectrum.factor_columns=1"] if name.startswith("columns") else []
    noise = ["noise.variance=1"] if name == "indistinguishable" else []
    with pytest.raises(SpecError, match=message or None) as caught:
        validate(changed(CONTINUOUS, override, *extra, *noise))
    diagnostic = caught.value.diagnostics[0]
    assert (diagnostic.code, caught.value.exit_code) == (code, EXIT_BAD_INPUT)
    assert diagnostic.hint
    assert diagnostic.key
