"""A command whose options stand once: of two values one would be dropped without a word."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer
from typer.core import TyperCommand, TyperOption

if TYPE_CHECKING:
    from typer._click import Context


class OnceCommand(TyperCommand):
    """Refuses options that stand there twice, unless they are repeatable."""

    def parse_args(self, ctx: Context, args: list[str]) -> list[str]:
        """What typer makes of the arguments.

        Raises:
            typer.BadParameter: An option that takes one value has several.
        """
        _, _, stated = self.make_parser(ctx).parse_args(args=list(args))
        for option in stated:
            single = isinstance(option, TyperOption) and not (option.multiple or option.is_flag)
            if single and stated.count(option) > 1 and not ctx.resilient_parsing:  # as of completions
                message = "it stands there twice, and takes one value: leave one of them out"
                raise typer.BadParameter(message, param_hint=option.opts[0])
        return super().parse_args(ctx, args)
