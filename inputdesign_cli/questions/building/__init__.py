"""Parts of a spec become objects: model, loop, requirements, limits, signals."""
