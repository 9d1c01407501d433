"""A local page that follows a spec, a campaign or a sweep: what it shows, and who serves it."""
