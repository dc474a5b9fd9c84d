"""The command line: click, thin, no logic."""
