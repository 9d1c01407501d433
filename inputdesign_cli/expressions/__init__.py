"""Expressions in named parameters, which specs write in place of numbers."""

from inputdesign_cli.expressions.expression import (
    Expression as Expression,
    ExpressionError as ExpressionError,
    evaluated as evaluated,
    is_name as is_name,
    product_of as product_of,
)
from inputdesign_cli.expressions.steps import Evaluated as Evaluated
