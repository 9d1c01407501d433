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
    # Results on the disc
    "output-not-a-directory": Explanation(
        "The destination is a file",
        "A run is a directory of files.",
        "Choose another directory with -o.",
    ),
    "output-not-writable": Explanation(
        "The destination cannot be written",
        "The system refused; an earlier run there is as it was.",
        "Choose another place, or change the permissions.",
    ),
    "output-full": Explanation(
        "The disc is full",
        "There was no space for the results; nothing half-written remains.",
        "Free some space, or choose another disc.",
    ),
    "output-not-a-run": Explanation(
        "A file of yours is in the way",
        "The directory has a file of the same name that no earlier run wrote; it would be lost.",
        "Choose another directory with -o, or move the file away.",
    ),
    "output-exists": Explanation(
        "The file exists already",
        "`idesign init` does not overwrite.",
        "Choose another name, or give --force.",
    ),
    "run-missing": Explanation(
        "No finished run",
        "Without result.json a directory holds no whole run.",
        "Run `idesign solve SPEC -o DIR`.",
    ),
    "run-unreadable": Explanation(
        "The result cannot be read",
        "result.json is not one that idesign wrote, or it was changed.",
        "Run the spec again.",
    ),
    "run-incomplete": Explanation(
        "A file of the run is gone",
        "result.json lists a file that is no longer there.",
        "Run the spec again.",
    ),
    # Golden files
    "golden-path": Explanation(
        "Not a path into a result",
        "A path is keys with dots and list items in brackets.",
        "Write objective.value or power.input[0].",
    ),
    "golden-tolerance": Explanation(
        "Not one tolerance",
        "A quantity has either an absolute or a relative tolerance; 0 has no relative one.",
        "Give absolute, or relative.",
    ),
    "golden-name": Explanation(
        "Two runs of one name",
        "Results go by the name of the run.",
        "Rename one.",
    ),
    "golden-missing": Explanation(
        "No golden files",
        "The current folder has no golden/*.yaml, and the package installs none.",
        "Name golden files, or work in a checkout.",
    ),
    # The plant, its loop and its parameters
    "unstable-loop": Explanation(
        "The loop is unstable",
        "With u = r - C y the closed loop has a pole on or outside the unit circle: no stationary "
        "experiment can be run in it.",
        "Check the sign of the feedback, the delay of the plant, and that all polynomials are in q^-1.",
    ),
    "algebraic-loop": Explanation(
        "The loop is not well posed",
        "Plant and controller both act at once and 1 + C G vanishes at infinite frequency.",
        "Give the plant its delay (a leading 0 in B), or the controller one.",
    ),
    "not-identifiable": Explanation(
        "Some parameters cannot be told apart",
        "Even white excitation leaves the information matrix singular, most often because two "
        "polynomials share a factor.",
        "Lower an order, or cancel the common factor.",
    ),
    "unknown-parameter": Explanation(
        "The model has no such parameter",
        "Parameters are named a1, b1, c1, d1, f1 .. after their polynomial and power of q^-1.",
        "Use the names that the message lists.",
    ),
    "no-feedback": Explanation(
        "The controller is zero",
        "Without feedback the sensitivity is one whatever the model, so it asks nothing of the model.",
        "Give the controller of the loop that is to be kept.",
    ),
    # Accuracy and its data
    "admissible-not-positive": Explanation(
        "The admissible error vanishes",
        "At some frequency of the band r_adm is zero or negative: no experiment is long enough.",
        "Restrict the band, or loosen the requirement there.",
    ),
    "bad-table": Explanation(
        "The table of r_adm cannot be used",
        "It must have increasing frequencies, positive values, and cover the whole band.",
        "Mend the rows that the message names, or restrict the band.",
    ),
    "data-unreadable": Explanation(
        "A data file cannot be read",
        "The spec names a file that is missing, empty, no CSV file or too large.",
        "Paths are relative to the folder of the spec.",
    ),
    "data-missing-column": Explanation(
        "A column is missing",
        "Columns are found by the beginning of their header, such as frequency or r_adm.",
        "Rename the column in the header line.",
    ),
    "data-not-a-number": Explanation(
        "A cell is not a number",
        "Every cell below the header must be a finite number with a decimal point.",
        "Mend the cell, or remove the row.",
    ),
    # What was computed
    "integral-inaccurate": Explanation(
        "An integral did not settle",
        "The information matrix is an integral over frequency; here its integrand has a pole on the "
        "unit circle.",
        "Move the pole inside, or close a stable loop around the integrator.",
    ),
    "gap-not-closed": Explanation(
        "The proof did not close",
        "The design and the proved lower bound stayed further apart than 100 solver.tolerance.",
        "Loosen solver.tolerance, lower the order, or rescale a nearly unidentifiable model.",
    ),
    "numerically-singular": Explanation(
        "The information matrix is singular to working precision",
        "Some parameters are so nearly indistinguishable that double precision cannot tell them apart.",
        "Lower the orders, or look for poles and zeros that nearly cancel.",
    ),
    "solver-failed": Explanation(
        "The solver failed",
        "The grid program of solver.method lmi ended without an answer.",
        "Use solver.method exchange.",
    ),
    "not-supported": Explanation(
        "Not in this version",
        "The spec is well formed, but this version does not do what it asks; it is never ignored silently.",
        "Do as the hint says, or watch CHANGELOG.md.",
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
