"""CaMP and its baselines: trained on the shards, measured like the paper."""
