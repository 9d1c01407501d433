"""Given excitations of several channels and in continuous time: closed forms, simulation, tables."""

from pathlib import Path

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli import analyse, load_spec, parse_spec
from inputdesign_cli.errors import DataError, SpecError

SPECS = Path(__file__).parents[2] / "specs"
GIVEN = SPECS / "two_by_two_given.yaml"
NOISE = np.array([[1.0, 0.4], [0.4, 0.5]])
A = np.array([-0.7, 0.4])
B = np.array([[[1.0, 0.4], [-0.5, 0.3]], [[0.6, 0.2], [1.2, -0.5]]])  # b1, b2 of each entry

CONTINUOUS = """
plant:
  continuous:
    numerator: [[[3.125], [3.188]], [[5.313], [1.563]]]
    denominator: [[[1, 1.5, 1.563], [1, 2, 1.063]], [[1, 0.5, 1.063], [1, 1, 0.312]]]
noise: {variance: [[1, 0], [0, 1]]}
"""


def changed(*overrides):
    return load_spec(GIVEN, list(overrides))


def by_simulation(u, length):
    """M (10, 10) of the ARX plant of the spec from samples u (n, 2), in the order of NAMES."""
    y = np.stack(
        [
            scipy.signal.lfilter(
                [1.0], [1.0, A[i]], sum(scipy.signal.lfilter([0, *B[i, j]], 1, u[:, j]) for j in (0, 1))
            )
            for i in (0, 1)
        ]
    )
    psi = np.zeros((10, 2, len(u)))
    for i in (0, 1):
        psi[i, i] = np.r_[0.0, -y[i, :-1]]
        for j in (0, 1):
            for lag in (1, 2):
                psi[2 + 4 * i + 2 * j + lag - 1, i] = np.r_[np.zeros(lag), u[:-lag, j]]
    inverse = np.linalg.inv(NOISE)
    M = np.einsum("kpt,pq,lqt->kl", psi, inverse, psi)
    i, j = np.indices((2, 2))
    M[:2, :2] += length * inverse * NOISE / (1 - A[i] * A[j])
    return M


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    rng = np.random.default_rng(3)
    u = rng.normal(size=(400, 2)) @ np.array([[1.0, 0.3], [0.0, 2.0]])
    path = tmp_path_factory.mktemp("given") / "u.csv"
    rows = "\n".join(f"{t},{a:.17g},{b:.17g}" for t, (a, b) in enumerate(u))
    path.write_text("time_s,u1,u2\n" + rows + "\n", encoding="utf-8")
    return path, u


def test_a_record_has_the_information_of_its_regressors(record):
    path, u = record
    outcome = analyse(changed(f"spectrum={{given: {{signal: {path}}}}}"))
    result = outcome.result
    assert result["samples"] == 400
    np.testing.assert_allclose(result["information"]["matrix"], by_simulation(u, 400), rtol=1e-8, atol=1e-6)
    np.testing.assert_allclose(result["power"]["input"], np.mean(u**2, axis=0), rtol=1e-12)
    assert result["signal"]["worst_ratio"] == pytest.approx(result["model_error"]["worst_ratio"], rel=1e-9)


def test_sinusoids_in_phase_have_the_information_of_a_long_record():
    spec = changed("signal.samples=100000")
    outcome = analyse(spec)
    assert outcome.result["power"]["input"] == pytest.approx([22.5, 22.5])
    signal = outcome.tables["signal"].columns
    u = np.stack([signal["u1"], signal["u2"]], axis=1)
    M = by_simulation(u, 100000) / 200
    scale = np.sqrt(np.outer(np.diag(M), np.diag(M)))
    assert np.abs((outcome.result["information"]["matrix"] - M) / scale).max() < 2e-3


def test_white_noise_has_the_information_of_a_sum_over_the_unit_circle():
    """M = N/L sum over L points of the circle: exact for an ARX plant."""
    result = analyse(changed("spectrum={given: {type: white, power: [3.0, 5.0]}}")).result
    assert result["information"]["parameters"] == NAMES
    z = np.exp(-2j * np.pi * np.arange(256) / 256)
    F = np.zeros((256, 10, 2, 2), dtype=complex)
    for i in (0, 1):
        for j in (0, 1):
            F[:, i, i, j] = -z * (B[i, j, 0] * z + B[i, j, 1] * z**2) / (1 + A[i] * z)
            for lag in (1, 2):
                F[:, 2 + 4 * i + 2 * j + lag - 1, i, j] = z**lag
    inverse = np.linalg.inv(NOISE)
    M = 500 / 256 * np.einsum("nkpa,pq,nlqa,a->kl", F, inverse, F.conj(), [3.0, 5.0], optimize=True).real
    i, j = np.indices((2, 2))
    M[:2, :2] += 500 * inverse * NOISE / (1 - A[i] * A[j])
    np.testing.assert_allclose(result["information"]["matrix"], M, rtol=1e-9, atol=1e-7)
    assert result["cost"] == pytest.approx(8.0)


NAMES = ["a1[1]", "a1[2]"] + [f"b{lag}[{i},{j}]" for i in (1, 2) for j in (1, 2) for lag in (1, 2)]


def by_finite_differences(names, lines):
    """M (12, 12) of 50 samples for power matrices (2, 2) at frequencies, in the order of the names."""
    low = {"b0[1,1]": 3.125, "b0[1,2]": 3.188, "b0[2,1]": 5.313, "b0[2,2]": 1.563}
    high = [[(1.5, 1.563), (2, 1.063)], [(0.5, 1.063), (1, 0.312)]]
    values = low | {
        f"a{1 - at}[{i + 1},{j + 1}]": high[i][j][at] for i in (0, 1) for j in (0, 1) for at in (0, 1)
    }

    def transfer(values, s):
        return np.array(
            [
                [
                    values[f"b0[{i},{j}]"] / (s**2 + values[f"a1[{i},{j}]"] * s + values[f"a0[{i},{j}]"])
                    for j in (1, 2)
                ]
                for i in (1, 2)
            ]
        )

    M = np.zeros((12, 12))
    for w, power in lines:
        columns = []
        for name in names:
            h = 1e-6
            up, down = values | {name: values[name] + h}, values | {name: values[name] - h}
            columns.append((transfer(up, 1j * w) - transfer(down, 1j * w)) / (2 * h))
        F = np.array(columns)
        M += 50 * np.einsum("aij,jk,bik->ab", F, power, F.conj()).real
    return M


def test_lines_in_continuous_time_have_the_information_by_finite_differences():
    given = "{given: {type: multisine, frequencies: [0.2, 0.7, 1.3], amplitudes: [[3, 3, 3], [2, -2, 1]]}}"
    result = analyse(
        parse_spec(CONTINUOUS, overrides=[f"spectrum={given}", "experiment={samples: 50}"])
    ).result
    lines = [(w, np.outer(a, a) / 2) for w, a in [(0.2, (3, 2)), (0.7, (3, -2)), (1.3, (3, 1))]]
    M = by_finite_differences(result["information"]["parameters"], lines)
    np.testing.assert_allclose(result["information"]["matrix"], M, rtol=1e-6, atol=1e-6 * M.max())


def test_a_table_of_power_matrices_has_the_information_by_finite_differences(tmp_path):
    """Power matrices of every rank and phase, as `spectrum.csv` of a design holds them."""
    lines = [
        (0.2, np.array([[1.0, 0.3 - 0.4j], [0.3 + 0.4j, 0.5]])),
        (0.7, np.array([[0.4, 0.4j], [-0.4j, 0.4]])),
        (1.3, np.array([[0.2, 0.0], [0.0, 0.0]])),
        (1.9, np.array([[0.0, 0.0], [0.0, 0.7]])),
    ]
    table = tmp_path / "spectrum.csv"
    rows = [f"{w},{p[0, 0].real},{p[0, 1].real},{p[0, 1].imag},{p[1, 1].real}" for w, p in lines]
    header = "frequency_rad_per_s,power_11,power_12_re,power_12_im,power_22"
    table.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    given = f"spectrum={{given: {{type: table, file: {table}}}}}"
    result = analyse(parse_spec(CONTINUOUS, overrides=[given, "experiment={samples: 50}"])).result
    np.testing.assert_allclose(result["power"]["input"], [1.6, 1.6], rtol=1e-12)
    M = by_finite_differences(result["information"]["parameters"], lines)
    np.testing.assert_allclose(result["information"]["matrix"], M, rtol=1e-6, atol=1e-6 * M.max())


def test_a_record_of_one_channel_has_the_output_power_of_the_held_plant(tmp_path):
    text = """
plant: {continuous: {numerator: [2.0], denominator: [1, 0.6, 1]}, sample: zoh}
noise: {variance: 0.1}
"""
    path = tmp_path / "u.csv"
    u = np.random.default_rng(1).normal(size=300)
    path.write_text(
        "time_s,u1\n" + "\n".join(f"{t},{v:.17g}" for t, v in enumerate(u)) + "\n", encoding="utf-8"
    )
    result = analyse(parse_spec(text, overrides=[f"spectrum={{given: {{signal: {path}}}}}"])).result
    assert result["information"]["parameters"] == ["b0", "a0", "a1"]
    held = scipy.signal.cont2discrete(([2.0], [1, 0.6, 1]), 1.0)
    y = scipy.signal.lfilter(held[0].ravel(), held[1], u)
    assert result["power"]["output"][0] == pytest.approx(np.mean(y**2), rel=1e-9)


BAD = [
    ("{given: {type: white, power: 1}}", CONTINUOUS, "needs-band"),
    (
        "{given: {type: multisine, frequencies: [0.5], amplitudes: [[1], [1]]}}",
        GIVEN.read_text(encoding="utf-8"),
        "not-exciting",
    ),
    (
        "{given: {type: multisine, frequencies: [0.5, 1], amplitudes: [[0, 0], [0, 0]]}}",
        CONTINUOUS,
        "not-exciting",
    ),
    ("{given: {signal: nowhere.csv}}", CONTINUOUS, "data-unreadable"),
]


@pytest.mark.parametrize(("given", "text", "code"), BAD)
def test_unusable_excitations_are_refused(given, text, code):
    with pytest.raises((SpecError, DataError)) as caught:
        analyse(parse_spec(text, overrides=[f"spectrum={given}"]))
    assert caught.value.diagnostics[0].code == code
