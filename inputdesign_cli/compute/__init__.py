"""Where pieces of work are computed: in this process, in others, on a cluster."""
