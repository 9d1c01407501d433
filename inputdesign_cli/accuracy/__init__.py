"""Requirements on the accuracy of the model, one a file."""

from inputdesign_cli.accuracy.admissible import Absolute as Absolute
from inputdesign_cli.accuracy.admissible import AdmissibleError as AdmissibleError
from inputdesign_cli.accuracy.admissible import Relative as Relative
from inputdesign_cli.accuracy.admissible import Sensitivity as Sensitivity
from inputdesign_cli.accuracy.admissible import Table as Table
from inputdesign_cli.accuracy.admissible import Weighted as Weighted
from inputdesign_cli.accuracy.criteria import Criterion as Criterion
from inputdesign_cli.accuracy.cuts import Cut as Cut
from inputdesign_cli.accuracy.cuts import CutBlock as CutBlock
from inputdesign_cli.accuracy.cuts import MatrixCut as MatrixCut
from inputdesign_cli.accuracy.cuts import positive_part as positive_part
from inputdesign_cli.accuracy.ellipsoid import EllipsoidError as EllipsoidError
from inputdesign_cli.accuracy.information_target import InformationTarget as InformationTarget
from inputdesign_cli.accuracy.model_error import ModelError as ModelError
from inputdesign_cli.accuracy.over_frequency import active_entries as active_entries
from inputdesign_cli.accuracy.requirement import BoundedError as BoundedError
from inputdesign_cli.accuracy.requirement import Entry as Entry
from inputdesign_cli.accuracy.requirement import Level as Level
from inputdesign_cli.accuracy.requirement import Requirement as Requirement
from inputdesign_cli.accuracy.requirement import Violation as Violation
from inputdesign_cli.accuracy.requirement import worst as worst
from inputdesign_cli.accuracy.weighted_variance import WeightedVariance as WeightedVariance
