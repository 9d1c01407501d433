"""From a record alone to a model: delays, orders and families, judged on data that they have not seen."""

from inputdesign_cli.explore.candidates import Candidate as Candidate, Chosen as Chosen
from inputdesign_cli.explore.cycles import own_cycles as own_cycles
from inputdesign_cli.explore.drifting import explore_records as explore_records, levelled as levelled
from inputdesign_cli.explore.fits import (
    Fits as Fits,
    by_chance as by_chance,
    fits as fits,
    output_error_form as output_error_form,
)
from inputdesign_cli.explore.helping import unhelpful as unhelpful
from inputdesign_cli.explore.inputs import (
    left_of_inputs as left_of_inputs,
    order_of_excitation as order_of_excitation,
)
from inputdesign_cli.explore.interpolated import interpolated_outputs as interpolated_outputs
from inputdesign_cli.explore.joint import Found as Found
from inputdesign_cli.explore.laws import (
    answers_between_moves as answers_between_moves,
    only_answers as only_answers,
    set_apart as set_apart,
    together_at_once as together_at_once,
)
from inputdesign_cli.explore.loops import answers_output as answers_output
from inputdesign_cli.explore.one_line import one_line as one_line
from inputdesign_cli.explore.search import explore_structure as explore_structure
from inputdesign_cli.explore.switched import early_answers as early_answers
from inputdesign_cli.explore.unstable import unstable_pole as unstable_pole
