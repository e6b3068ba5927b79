"""What can be said of a mesh: topology, quality, deviation, and the report that gathers it."""
