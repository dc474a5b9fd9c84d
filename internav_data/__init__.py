"""internav: interactive-navigation data."""
