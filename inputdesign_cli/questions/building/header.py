"""Spec -> units and header, which travel with all that is computed."""

from __future__ import annotations

from inputdesign_cli.outcome.units import Header, Units
from inputdesign_cli.specification import Spec


def build_units(spec: Spec) -> Units:
    """Build the units and channel names of the experiment of a spec."""
    return Units(
        time_unit=spec.time_unit,
        sample_time=spec.sample_time,
        sampled=spec.plant.sampled,
        closed_loop=spec.experiment.controller is not None,
        inputs=spec.plant.inputs,
        outputs=spec.plant.outputs,
        channels={name: (one.name or "", one.unit or "") for name, one in (spec.channels or {}).items()},
        by_duration=spec.experiment.duration is not None or spec.limits.duration is not None,
    )


def build_header(spec: Spec) -> Header:
    """Build the header of all results of a spec."""
    return Header(spec.title, spec.to_yaml(), build_units(spec))
