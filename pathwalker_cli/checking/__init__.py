"""Whether a file can be used, and what would be done with it, without solving anything."""
