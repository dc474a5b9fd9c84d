"""houses."""
