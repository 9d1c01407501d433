"""Figures of runs and sweeps."""

import logging

# No warning if the cache of matplotlib cannot be written: it then uses another place.
logging.getLogger("matplotlib").setLevel(logging.ERROR)
