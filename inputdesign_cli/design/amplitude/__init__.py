"""The signals within an amplitude: what their autocovariances can be, and the best of them."""
