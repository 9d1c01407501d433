"""The next part of a campaign is not the experiment that the spec asks for."""

from __future__ import annotations

from inputdesign_cli.finding import Finding, FindingKind, Severity

PART_WITHOUT_DESIGN = FindingKind(
    "part-without-design",
    Severity.NOTE,
    "the next part is white noise",
    "At the present estimate no experiment meets what is asked. The next part is white noise at the cost of "
    "the first plan or of the pilot. The estimate after it decides.",
    "Apply the part. If it happens again, look at the structure of the model and at the limits.",
)
PLAN_CAPPED = FindingKind(
    "plan-capped",
    Severity.NOTE,
    "the plan misses the accuracy that is asked",
    "A sample may cost at most campaign.power_cap times a sample of the first plan; the default is 10. The "
    "campaign ends after campaign.max_samples. Within these bounds and `limits` no plan meets what is asked.",
    "Raise campaign.power_cap, campaign.max_samples or a limit, or ask for less.",
)
PART_SCALED = FindingKind(
    "part-scaled",
    Severity.NOTE,
    "the next part is weaker than its plan",
    "A part may cost more than its plan does on average. Its power is lowered so that a sample costs no more "
    "than campaign.power_cap. This holds at the estimate and at the plant of the spec.",
    "Raise campaign.power_cap if the plant can bear it.",
)
EARLIER_PARTS_COST = FindingKind(
    "earlier-parts-cost",
    Severity.NOTE,
    "earlier parts make the next one expensive",
    "Earlier parts still move the plant while the next one is applied. With that a sample costs more than "
    "campaign.power_cap allows.",
    "Wait until the plant is at rest, or accept the cost.",
)
PART_NOT_ROBUST = FindingKind(
    "part-not-robust",
    Severity.NOTE,
    "the last part is planned for the estimate alone",
    "The last part should suffice for every plant that the data leave open. For some of these plants no "
    "experiment within campaign.power_cap and `limits` does.",
    "Raise campaign.power_cap or a limit, or write campaign.last: nominal.",
)
_NEARLY = 0.9  # a part of less than this share of its power is named


def planned_otherwise(
    file: str, *, why: str, capped: bool, share: float, beyond: bool, part_cost: float, fragile: bool
) -> list[Finding]:
    """Return findings for a plan that is not as the spec asks.

    Args:
        file: of the plan.
        why: the reason why there is no design; empty if there is one.
        capped: whether the plan meets less than is asked.
        share: of its power that the part has.
        beyond: whether a sample costs more than the cap; it costs `part_cost`.
        fragile: whether a robust last part was wanted and not found.
    """
    found = []
    if why:
        message = (
            f"there is no design at this estimate ({why}). The next part is white noise at the cost of the "
            "first plan, or of the pilot. The estimate after it decides"
        )
        found.append(PART_WITHOUT_DESIGN.found(message, where=file, why=why))
    if capped:
        message = (
            f"{file} misses the accuracy that is asked: campaign.power_cap (default: 10 times the first "
            "plan) or limits allow no more until campaign.max_samples"
        )
        found.append(PLAN_CAPPED.found(message, where=file))
    if share < _NEARLY:
        message = (
            f"the part has {100 * share:.0f} % of the power of {file}: with all of it, it would cost more "
            "than campaign.power_cap at the estimate or the plant of the spec"
        )
        found.append(PART_SCALED.found(message, where=file, share=share))
    if beyond:
        message = (
            f"a sample of the next part costs {part_cost:.4g}, more than campaign.power_cap allows, since "
            "earlier parts still move the plant"
        )
        found.append(EARLIER_PARTS_COST.found(message, where=file, cost=part_cost))
    if fragile:
        message = (
            f"{file} is planned for the estimate alone: some plant that the data leave open asks for more "
            "than campaign.power_cap and limits allow"
        )
        found.append(PART_NOT_ROBUST.found(message, where=file))
    return found
