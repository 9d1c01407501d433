"""What a reader looks at: figures of a run."""

import logging

# That its cache cannot be written is no news for the user: matplotlib then uses another place.
logging.getLogger("matplotlib").setLevel(logging.ERROR)
