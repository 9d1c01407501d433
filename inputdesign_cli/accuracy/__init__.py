"""Requirements on the accuracy of the model, one a file."""

from inputdesign_cli.accuracy.criteria import (
    Criterion as Criterion,
    InformationTarget as InformationTarget,
    criterion_of as criterion_of,
)
from inputdesign_cli.accuracy.cuts import (
    ConcaveFunction as ConcaveFunction,
    Cut as Cut,
    CutBlock as CutBlock,
    Inequality as Inequality,
    MatrixCut as MatrixCut,
    positive_part as positive_part,
)
from inputdesign_cli.accuracy.ellipsoid import EllipsoidError as EllipsoidError
from inputdesign_cli.accuracy.model_error import (
    Absolute as Absolute,
    AdmissibleError as AdmissibleError,
    Floored as Floored,
    ModelError as ModelError,
    OnModelError as OnModelError,
    Relative as Relative,
    Sensitivity as Sensitivity,
    Table as Table,
    Weighted as Weighted,
    model_errors as model_errors,
)
from inputdesign_cli.accuracy.requirement import (
    Entry as Entry,
    Requirement as Requirement,
    Violation as Violation,
    active_entries as active_entries,
    inverse_factor as inverse_factor,
    least_ratios as least_ratios,
    worst as worst,
    worst_ratio as worst_ratio,
)
from inputdesign_cli.accuracy.weighted_variance import WeightedVariance as WeightedVariance
