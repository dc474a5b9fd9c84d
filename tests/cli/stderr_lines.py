"""Lines that a command wrote on stderr."""


def beside_the_dataset(stderr):
    """The lines, less the first one where it names the dataset."""
    lines = stderr.strip().splitlines()
    return lines[1:] if lines and lines[0].startswith("dataset: ") else lines
