"""Files, settings, progress, locks and interrupts: what every room uses and no house is in."""
