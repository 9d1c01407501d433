"""What each error code means; `idesign explain CODE` shows it.

A code is a kebab-case word and is never renamed. Each room that makes diagnostics adds its codes here; a
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
    "bad-include": Explanation(
        "A file that cannot be included",
        "include: model.yaml (or a list) takes blocks from other files, relative to the folder of the spec. "
        "What they hold stands where the spec has none: plant and noise as a whole, other blocks key by key. "
        "The same key in both is a contradiction.",
        "Remove the key from one of the files; an included file includes no others.",
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
        "Something costs nothing",
        "With weights of zero every experiment is as good as any other. Of several inputs no combination may "
        "be free either: the power of one output does not show what two inputs do that cancels in it.",
        "Give a positive weight, with several inputs to input_power.",
    ),
    "needs-limits": Explanation(
        "The best experiment without a limit",
        "More power always means more accuracy: a criterion has no best value, and the shortest "
        "experiment is one sample, unless a power is limited. Limits on fewer outputs than there are inputs "
        "leave combinations of the inputs without a limit.",
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
    "needs-band": Explanation(
        "The band of the excitation is missing",
        "A sampled system has frequencies up to pi/sample_time; in continuous time they have no end, and an "
        "excitation of limited power must be told where it may be.",
        "Add limits.band, or choose a polynomial spectrum with its band.",
    ),
    # The plant, its loop and its parameters
    "unstable-loop": Explanation(
        "The loop is unstable",
        "With u = r - C y the closed loop has a pole on or outside the unit circle: no stationary "
        "experiment can be run in it.",
        "Check the sign of the feedback, the delay of the plant, and that the controller is in q^-1, also "
        "where the plant is in s.",
    ),
    "algebraic-loop": Explanation(
        "The loop has no delay",
        "Plant and controller both act at once. If 1 + C G vanishes at infinite frequency the loop is not "
        "even well posed; if it does not, u(t) answers the noise of y(t) within the sample, and a model "
        "estimated from u and y is biased, however long the experiment.",
        "Give the plant its delay (a leading 0 in B; in s a numerator of lower order than the denominator), "
        "or the controller one (a leading 0 in its numerator).",
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
    # The loop that the model will serve
    "not-square": Explanation(
        "A plant or a loop that is not square",
        "The controller is computed with the inverse of the plant, so it needs as many inputs as outputs, "
        "and the desired loop from reference to output has that size too.",
        "Choose as many inputs as outputs; write t for t I, or a square matrix.",
    ),
    "singular-plant": Explanation(
        "A plant without an inverse",
        "Its determinant vanishes at every frequency: some combination of the outputs cannot be moved.",
        "Check the gains in B, or leave out an input and an output.",
    ),
    "non-minimum-phase": Explanation(
        "A plant whose inverse is unstable",
        "Model-reference and minimum-variance control cancel the zeros of the plant. A zero outside the unit "
        "circle becomes an unstable pole of the controller.",
        "Use internal_model, which keeps such zeros and the delay in the loop.",
    ),
    "infinite-criterion": Explanation(
        "A zero of the plant on the unit circle",
        "The controller would have a pole there, and any error of the model at that frequency an infinite "
        "effect on the loop.",
        "Let the desired loop vanish there too by choosing another plant model or control law.",
    ),
    "delay-too-short": Explanation(
        "A desired loop that is not strictly proper enough",
        "The loop from reference to output cannot be faster than the plant: the desired loop needs at least "
        "the delay of the plant, or else the controller would use future outputs.",
        "Begin the numerator in q^-1 with as many zeros as the message says, or use internal_model.",
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
        "The grid program of solver.method lmi, or that of a parametric closed_loop_error, ended without an "
        "answer.",
        "Use solver.method exchange, or covariance: asymptotic.",
    ),
    "infeasible": Explanation(
        "The requirements cannot be met within the limits",
        "A certificate proves it: multipliers of the requirements and limits that no spectrum of this type "
        "can satisfy together. The message says how much power would be needed with the other limits kept, "
        "and how much the accuracy would have to be loosened instead.",
        "Raise the limit that the message names, loosen the requirement, take more samples, or use a richer "
        "spectrum (a higher order, or type: free).",
    ),
    "contradictory-limits": Explanation(
        "Lower limits that upper limits exclude",
        "No spectrum of this type reaches the lower limits (min) while it keeps to the upper ones (max), "
        "whatever the accuracy.",
        "Lower min or raise max of the limits that the message names.",
    ),
    "too-long": Explanation(
        "The shortest experiment is longer than limits.samples",
        "Within the limits on power, no experiment of limits.samples samples reaches the accuracy; the "
        "message gives the length that does, and the proved lower bound.",
        "Allow more samples or more power, or ask for less accuracy.",
    ),
    "bad-limit": Explanation(
        "A limit that this family of spectra cannot keep",
        "A FIR spectrum never vanishes over a whole band; sinusoids have no density; an upper bound that "
        "vanishes, or a lower bound above the upper one, leaves no spectrum at all.",
        "Choose a family that can keep the limit, or change the limit as the message says.",
    ),
    "too-few-lines": Explanation(
        "Sinusoids that cannot tell the parameters apart",
        "Each sinusoid determines at most two parameters (one at frequency zero or pi), so that fewer lines "
        "than half the number of parameters leave some of them undetermined at any power.",
        "Give more frequencies or lines, widen limits.band, or use type: free.",
    ),
    "not-exciting": Explanation(
        "The given excitation leaves parameters undetermined",
        "The information matrix is singular: some combination of parameters does not influence the predicted "
        "output at all under this excitation, so that its variance is infinite.",
        "Excite more frequencies, or drop parameters.",
    ),
    "data-wrong-unit": Explanation(
        "The times of the data are in another unit",
        "The name of the column of times ends with its unit (time_ms); the spec has another time_unit.",
        "Set time_unit and sample_time of the spec in that unit, or convert the column.",
    ),
    "nothing-to-assess": Explanation(
        "The spec states no target",
        "idesign assess compares what data give with what accuracy asks for; a criterion alone can be "
        "neither met nor missed.",
        "State model_error, standard_deviation or another requirement under accuracy.",
    ),
    "nothing-to-simulate": Explanation(
        "There is no experiment to simulate",
        "What is asked is known already without any excitation, so that the design is to do nothing; or the "
        "record of the excitation would be too short to hold its sinusoids.",
        "Ask for more accuracy or a longer signal, or give an excitation under spectrum.given.",
    ),
    "too-few-samples": Explanation(
        "There are too few samples for the number of parameters",
        "An estimate from hardly more samples than parameters follows the noise, and its covariance means "
        "nothing.",
        "Record more samples, or lower the orders of the polynomials.",
    ),
    "constant-input": Explanation(
        "The input never changes",
        "A constant input excites the static gain at most; dynamics cannot be identified from it.",
        "Check that the right column is named u, and that the signal reached the plant.",
    ),
    "constant-output": Explanation(
        "The output never changes",
        "A constant output shows neither the input nor noise: most often the logger was stuck or the column "
        "is another one.",
        "Check that the right column is named y.",
    ),
    "noise-free-data": Explanation(
        "The data have no noise",
        "The model reproduces the output to rounding, so that the variance of the noise, and with it every "
        "confidence region, is zero. Or the residuals of one output follow from those of others.",
        "Use recorded data, or add noise to simulated ones; leave out outputs that are computed from others.",
    ),
    "data-not-uniform": Explanation(
        "The samples are not taken at the sample time of the spec",
        "The column of times must advance by sample_time from row to row; a model of sampled data has no "
        "meaning otherwise.",
        "Correct sample_time (or time_unit), fill the gaps, or resample.",
    ),
    "nothing-given": Explanation(
        "There is no excitation to analyse",
        "idesign analyse evaluates an excitation that stands under spectrum.given; this spec asks for a "
        "design.",
        "Write spectrum: {given: {type: white, power: 1}}, {given: {type: multisine, ..}} or "
        "{given: {signal: u.csv}}, or run idesign solve.",
    ),
    "not-sampled": Explanation(
        "A transfer function in s where one in q^-1 is needed",
        "The experiment is in discrete time; a weight in s must say how it is sampled.",
        "Write sample: zoh beside continuous, or give numerator and denominator in q^-1.",
    ),
    "zero-parameter": Explanation(
        "A relative error of a parameter that is zero",
        "scale: relative measures each parameter by its nominal value, and one of them is zero.",
        "Use scale: absolute, or drop the parameter from the model.",
    ),
    # Sweeps and clusters
    "bad-range": Explanation(
        "A range of a sweep is not one",
        "A range is low:high:step; the step leads from the first number to the second and is not 0.",
        "Write 0:40:5, or list the values: 0,5,10.",
    ),
    "sweep-empty": Explanation(
        "A sweep that varies nothing",
        "Neither the spec has a `sweep` block nor does any --set name several values.",
        "Write --set experiment.samples=250,500,1000, or use `idesign solve` for a single run.",
    ),
    "sweep-lengths": Explanation(
        "Values side by side are not equally many",
        "With --zip the first values of all keys make the first point, the second the second, and so on.",
        "Give each key as many values, or leave out --zip for every combination.",
    ),
    "sweep-twice": Explanation(
        "A key is swept twice",
        "Two --set of one command name several values for the same key.",
        "Give all values at once: --set key=v1,v2,v3.",
    ),
    "sweep-too-large": Explanation(
        "The sweep has too many points",
        "Every combination of all values is a point; more than a million are refused.",
        "Vary fewer keys at once, or take their values side by side with --zip.",
    ),
    "sweep-locked": Explanation(
        "Another sweep is at work in the directory",
        "One process writes into the directory of a sweep at a time. The lock is that of a living process: "
        "it ends with it, however it ends.",
        "Wait for the other sweep, or write into another directory with -o.",
    ),
    "output-not-a-sweep": Explanation(
        "The directory holds something else",
        "A sweep is written into a new directory, an empty one, or one of an earlier sweep.",
        "Choose another directory with -o.",
    ),
    "worker-lost": Explanation(
        "A worker ended in the middle of its work",
        "The process that computed a point, or a batch of simulated runs, was killed, twice: the system may "
        "have run out of memory.",
        "Run it again with fewer processes; such points of a sweep are always tried again.",
    ),
    "internal-error": Explanation(
        "An error inside idesign",
        "The point met an error that idesign did not foresee: a mistake of idesign, not of the spec.",
        "Please report it with the spec.yaml of the sweep; the other points are not concerned.",
    ),
    "cluster-extra": Explanation(
        "Dask is not installed",
        "Computing on a cluster needs packages that are not installed by default.",
        "pip install 'inputdesign-cli[cluster]', on the workers too.",
    ),
    "cluster-unreachable": Explanation(
        "There is no cluster to compute on",
        "Nothing answers at the address, or the scheduler there has no workers.",
        "Start `dask scheduler` and `dask worker ADDRESS --nthreads 1`, or compute here with --jobs.",
    ),
    "cluster-version": Explanation(
        "The cluster has another version of idesign",
        "Every worker must run the same version as the caller: points of one sweep must be comparable.",
        "Install the same version everywhere.",
    ),
    # Regressions
    "zero-weights": Explanation(
        "The quantity of interest does not depend on the model",
        "All weights of the estimated parameters are zero, so its error is the same for every experiment.",
        "Give accuracy.mean_squared_error.estimated a weight other than 0.",
    ),
    "target-out-of-reach": Explanation(
        "The bias alone exceeds the target",
        "With delayed copies of one input the regressors cannot be correlated as the bias would need it. "
        "More energy reduces the variance, not the bias. The message tells the energy up to which this is "
        "proved, the smallest target and the largest norm of the neglected parameters that can be met.",
        "Raise the target, bound the neglected parameters more tightly, or estimate more of them.",
    ),
    "target-undecided": Explanation(
        "The target is neither met nor refuted",
        "The search found no moments that meet it, and the proof that there are none did not close.",
        "Raise the target, bound the neglected parameters more tightly, or estimate more of them.",
    ),
    "bad-period": Explanation(
        "The periods do not fit the record",
        "A record consists of a whole number of equal periods, each long enough for the moments.",
        "Choose a divisor of the number of samples, or change signal.samples.",
    ),
    "limits-too-tight": Explanation(
        "No record within the limits on single samples meets the accuracy",
        "The spectrum exists, but its records would exceed limits.amplitude, limits.rate or the range of the "
        "converter. Candidates were compressed, clipped and raised as far as the limits allow, and their own "
        "information falls short.",
        "The hint names a length that was found to suffice, or else the length that information in "
        "proportion to it would take. Or raise the limits, or loosen the accuracy.",
    ),
    "no-sample-rate": Explanation(
        "The sampling rate does not fit the file format",
        "A WAV file states its rate as a whole number of samples a second.",
        "Choose a sample time whose inverse is one, or take signal.mat or signal.csv.",
    ),
    "coarse-converter": Explanation(
        "The converter is too coarse for the signal",
        "One step of signal.quantisation, 2 range / 2^bits, is larger than a limit on the signal, or the "
        "offset lies at the end of its range.",
        "Take more bits or a smaller range, raise the limit, or move the offset.",
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
