"""Find a model in a record alone: delays, orders and families, judged on data that they have not seen."""

from inputdesign_cli.explore.drift import levelled as levelled
from inputdesign_cli.explore.fits import (
    Fits as Fits,
    Parts as Parts,
    by_chance as by_chance,
    fits as fits,
    output_error_form as output_error_form,
)
from inputdesign_cli.explore.joint import Found as Found, explore_records as explore_records
from inputdesign_cli.explore.relation import (
    answers_output as answers_output,
    check_enough as check_enough,
    check_unpredictable as check_unpredictable,
    early_answers as early_answers,
    exact_multiple as exact_multiple,
    left_of_inputs as left_of_inputs,
    like_answers as like_answers,
    only_answers as only_answers,
    order_of_excitation as order_of_excitation,
    unhelpful as unhelpful,
    unstable_pole as unstable_pole,
)
from inputdesign_cli.explore.search import (
    Candidate as Candidate,
    Family as Family,
    explore_structure as explore_structure,
)
