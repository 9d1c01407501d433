"""A local page that follows a spec, a campaign or a sweep: its content, and its server."""
