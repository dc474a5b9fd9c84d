"""Metrics, reference policies, tables, statistics and reports; no torch."""
