"""The cheapest, most accurate or shortest experiment within limits, with its proof."""
