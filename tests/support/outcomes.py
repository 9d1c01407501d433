"""Outcomes that tests put together as plain data."""

from inputdesign_cli.outcome import Outcome, read_plain


def typed(result):
    """Return the outcome that plain data stand for."""
    return read_plain(Outcome, result)


def codes_in(result):
    """Return the codes of the findings of a result as plain data."""
    return [one["code"] for one in result.get("findings", [])]
