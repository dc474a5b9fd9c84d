"""Settings, stores, caches, lazy imports, progress and interrupts: nothing here knows of houses."""
