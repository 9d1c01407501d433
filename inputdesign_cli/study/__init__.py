"""Studies: many runs of the verbs, here, in processes or on a cluster; trials on a simulated true system."""
