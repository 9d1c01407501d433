"""What each error code means; `idesign explain CODE` shows it.

A code is a kebab-case word and is never renamed. Each room that makes complaints adds its codes here; a
test finds those that are missing.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass

from inputdesign_cli.errors import bad_spec


@dataclass(frozen=True)
class Explanation:
    """A code in full: a title, what it means, and what to do."""

    title: str
    text: str
    remedy: str


CODES: dict[str, Explanation] = {
    # Files and YAML
    "file-missing": Explanation(
        "There is no such file",
        "The path of the spec leads nowhere. Relative paths start in the folder the command runs in.",
        "Check the spelling; the help line names a similar file if there is one.",
    ),
    "file-unreadable": Explanation(
        "The file cannot be read",
        "The path is a folder, or the system refuses to open it.",
        "Name a YAML file that you may read.",
    ),
    "file-too-large": Explanation(
        "The file is too large",
        "A spec is a page of text; more than 10 MiB is most likely a data file.",
        "Keep tables and signals in CSV files that the spec names.",
    ),
    "file-encoding": Explanation(
        "The file is not plain UTF-8 text",
        "It holds bytes that are not UTF-8, or control characters that YAML does not allow.",
        "Save it as UTF-8. A byte order mark at its start does no harm.",
    ),
    "empty-file": Explanation(
        "The spec is empty",
        "There is nothing in it but comments.",
        "`idesign init` writes a spec to start from.",
    ),
    "not-a-mapping": Explanation(
        "The file is not a mapping of keys",
        "A spec consists of keys and values (plant: .., noise: ..); this one is a list or a single word.",
        "Start from a spec that `idesign init` writes.",
    ),
    "several-documents": Explanation(
        "The file holds several documents",
        'A line "---" begins another YAML document; a file holds one spec.',
        "Put each spec into a file of its own, or sweep a key with `idesign sweep`.",
    ),
    "yaml-syntax": Explanation(
        "The file is not valid YAML",
        "The place is where the reader had to give up; the cause may stand just before it: a bracket or a "
        "quotation mark left open, a tab, an indentation that fits nothing.",
        "Mend this first: what follows cannot be read before.",
    ),
    "yaml-tag": Explanation(
        "A tag in the file",
        "Tags such as !!float or !!python/object change how a value is read. A spec has plain values only.",
        "Remove the tag.",
    ),
    "yaml-merge-key": Explanation(
        "A merge key in the file",
        'The key "<<" of older YAML merges one mapping into another; it is not supported.',
        "Write the keys out. Anchors and aliases may stand for whole values.",
    ),
    "yaml-limit": Explanation(
        "Too deep or too many values",
        "More than 64 levels or 100 000 values, aliases counted as often as they are used.",
        "Move large tables into CSV files.",
    ),
    "bad-text": Explanation(
        "An unprintable character in a text",
        "An escape in a quoted text makes a control character or half of a surrogate pair.",
        "Remove the escape.",
    ),
    "bad-key": Explanation(
        "A key is not a word",
        "A list, a mapping or a text with control characters stands where a key belongs.",
        'Write "key: value" with a plain word before the colon.',
    ),
    "duplicate-key": Explanation(
        "A key is given twice",
        "Other readers silently take the last one; here both are refused, because one is a mistake.",
        "Keep one of the two.",
    ),
    "empty-value": Explanation(
        "A key has no value",
        "Nothing, or null, stands behind the colon.",
        "Write a value, or remove the key: defaults apply to absent keys.",
    ),
    "bad-override": Explanation(
        "A --set that cannot be applied",
        "An override is key.path=value. Entries of lists go by their number from 0: plant.B.1=3. The "
        "value is "
        "YAML; null removes the key.",
        "Compare with --set noise.variance=0.5 and --set 'plant.F=[1, -0.7]'.",
    ),
    # Keys and kinds of values
    "unknown-key": Explanation(
        "A key that does not exist here",
        "It is misspelt or belongs under another key. Nothing is ignored silently.",
        "Follow the help line; `idesign schema` lets an editor complete the keys.",
    ),
    "unsuitable-key": Explanation(
        "A key that does not go with another",
        "The key exists, but not for this kind of plant, spectrum or signal.",
        "Remove it, or change the kind as the help line says.",
    ),
    "missing-key": Explanation(
        "A key is missing", "What stands here is not complete without it.", "Add the key that is named."
    ),
    "conflicting-keys": Explanation(
        "Keys that contradict each other",
        "Two keys fix the same thing, or ask for things that exclude each other.",
        "Keep one of them.",
    ),
    "unknown-word": Explanation(
        "A word that is not one of the choices",
        "The key takes one of a few words, which the message lists.",
        "Choose one of them.",
    ),
    "not-a-number": Explanation(
        "Not a number",
        "Numbers are written as 1, -0.5, 1e-3, .5 or 1. without quotes, units, underscores or leading zeros "
        "(010 is ten for some readers and eight for others). yes, no, on and off are texts; true and "
        "false are "
        "not numbers.",
        "Write a plain decimal number.",
    ),
    "not-finite": Explanation(
        "Not a finite number",
        "Infinity, nan, and numbers that double precision cannot hold are refused.",
        "Write a finite number; to have no limit, remove the key.",
    ),
    "not-a-whole-number": Explanation(
        "Not a whole number", "Counts are whole numbers; 500 and 500.0 both are.", "Round it."
    ),
    "not-a-text": Explanation(
        "Not a text", "A name or a text belongs here.", "Put it in quotes if it looks like something else."
    ),
    "out-of-range": Explanation(
        "A number outside its range",
        "The message gives the range. Powers, variances and limits are positive, probabilities lie "
        "between 0 and 1.",
        "Correct the number; to lift a limit, remove its key.",
    ),
    "wrong-shape": Explanation(
        "A value of the wrong shape",
        "Lists and matrices must agree with the plant: rows are outputs, columns are inputs; a "
        "polynomial is a "
        "list of coefficients; a matrix has a row per parameter or output.",
        "Compare with the shape that the message names.",
    ),
    "not-increasing": Explanation(
        "Frequencies do not increase", "A list of frequencies is sorted and has no repetitions.", "Sort it."
    ),
    "bad-band": Explanation(
        "Not a frequency band",
        "A band is [low, high] with 0 <= low < high, in rad per time unit.",
        "Exchange the ends or correct them.",
    ),
    "beyond-nyquist": Explanation(
        "A frequency beyond the Nyquist frequency",
        "A sampled system has frequencies up to pi/sample_time, in rad per time unit.",
        "Check sample_time and time_unit; frequencies in Hz have to be multiplied by 2 pi.",
    ),
    # Polynomials and matrices
    "not-monic": Explanation(
        "A polynomial does not start with 1",
        "A, C, D and F are monic: in A y = (B/F) u + (C/D) e their first coefficient, that of q^0, is 1.",
        "Divide by the first coefficient. What A, C, D or F loses must go into B or the noise variance.",
    ),
    "unstable-polynomial": Explanation(
        "A polynomial with roots outside the stability region",
        "In discrete time all roots in z of A, C, D and F lie strictly inside the unit circle, in "
        "continuous time "
        "all poles strictly in the left half plane. Only A may be unstable, and only under a controller.",
        "Check signs and order: polynomials in q^-1 ascend and start with 1, polynomials in s descend.",
    ),
    "zero-polynomial": Explanation(
        "A polynomial that is zero",
        "All its coefficients are zero, or the plant has no input.",
        "Correct it.",
    ),
    "zero-leading-coefficient": Explanation(
        "A denominator that starts with 0",
        "The first coefficient of a denominator, that of q^0 or of the highest power of s, is not zero.",
        "Remove the leading zeros; a delay belongs into the numerator.",
    ),
    "bad-polynomial": Explanation(
        "A polynomial beyond numerical reach",
        "Its order is above 300, or its coefficients differ by so much that its roots cannot be computed.",
        "Choose another time unit or write the denominator as a list of factors.",
    ),
    "improper-transfer": Explanation(
        "A system that is not proper",
        "The numerator has a higher degree in s than the denominator, so the gain grows without bound.",
        "Powers of s descend: [2, 1] is 2 s + 1. Check the order of the coefficients.",
    ),
    "not-symmetric": Explanation(
        "A matrix that is not symmetric",
        "Covariance and information matrices are symmetric; entries may differ by rounding only.",
        "Make the two entries equal.",
    ),
    "not-positive-definite": Explanation(
        "A matrix that is not positive definite",
        "A covariance has positive eigenvalues, a hessian or an information matrix none that are negative.",
        "Check its signs and the size of the entries off the diagonal.",
    ),
    # The question as a whole
    "nothing-asked": Explanation(
        "Nothing is asked of the model",
        "A design needs a requirement (model_error, information, application, weighted_variance, "
        "standard_deviation, mean_squared_error) or something to make best (criterion, closed_loop_error).",
        "Add one under accuracy, or fix the excitation under spectrum.given and run `idesign analyse`.",
    ),
    "no-cost": Explanation(
        "All cost weights are zero",
        "Then every experiment is as good as any other.",
        "Give a positive weight.",
    ),
    "needs-limits": Explanation(
        "The best experiment without a limit",
        "More power always means more accuracy: a criterion has no best value, and the shortest "
        "experiment is one "
        "sample, unless a power is limited.",
        "Add limits.input_power, limits.output_power or limits.excitation_power.",
    ),
    "needs-controller": Explanation(
        "A sensitivity without a loop",
        "r_adm from a sensitivity is (|1 + C G| - |W|)/|C|; C is the controller of the loop.",
        "Add experiment.controller, or a controller under sensitivity.",
    ),
    "contradictory-objective": Explanation(
        "The objective contradicts the accuracy",
        "least_cost and shortest_experiment meet requirements; best_accuracy makes a criterion best.",
        "Change the objective, or remove it: it follows from what accuracy holds.",
    ),
    "regression-mismatch": Explanation(
        "A regression and something that is not for regressions",
        "A regression is designed by its moments for mean-squared error, and that error is for "
        "regressions only.",
        "Use plant.regression, accuracy.mean_squared_error and spectrum type moments together.",
    ),
    "unknown-code": Explanation(
        "An error code that does not exist",
        "The code is misspelt, or comes from another version.",
        "`idesign explain` without a code lists all.",
    ),
}


def explanation(code: str) -> str:
    """The explanation of a code as text for a terminal.

    Raises
    ------
    SpecError : there is no such code; the hint names a similar one.
    """
    known = CODES.get(code)
    if known is None:
        near = difflib.get_close_matches(code, CODES, n=1)
        hint = f'did you mean "{near[0]}"?' if near else "`idesign explain` lists all codes"
        raise bad_spec("unknown-code", f"there is no error code {code!r}", hint=hint)
    return f"{code}: {known.title}\n\n{known.text}\n\nWhat to do: {known.remedy}"
