"""Requirements on the accuracy of the model, one a file."""

from inputdesign_cli.accuracy.admissible import Absolute as Absolute
from inputdesign_cli.accuracy.admissible import AdmissibleError as AdmissibleError
from inputdesign_cli.accuracy.admissible import Relative as Relative
from inputdesign_cli.accuracy.admissible import Sensitivity as Sensitivity
from inputdesign_cli.accuracy.admissible import Table as Table
from inputdesign_cli.accuracy.admissible import Weighted as Weighted
from inputdesign_cli.accuracy.model_error import ModelError as ModelError
from inputdesign_cli.accuracy.requirement import Cut as Cut
from inputdesign_cli.accuracy.requirement import Requirement as Requirement
from inputdesign_cli.accuracy.requirement import Violation as Violation
from inputdesign_cli.accuracy.requirement import worst as worst
