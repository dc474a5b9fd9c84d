"""The readers of `fuzz` steered by the code that the bytes reach; needs atheris.

    pip install atheris
    python tests/torture/fuzz_atheris.py journal -max_total_time=600

Words after the reader's name are libFuzzer's. It ends with the first input that is no typed error
in a line, and writes it to a file.
"""

from __future__ import annotations

import signal
import sys
import tempfile
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["internav_data"]):
    import fuzz


def main() -> None:
    """Fuzz one reader."""
    relative, valid, read = fuzz.reader_of(sys.argv.pop(1))
    folder = Path(tempfile.mkdtemp(prefix="torture-atheris-"))
    path = fuzz.beside(folder / "place", relative)
    (folder / "corpus").mkdir()
    (folder / "corpus" / "valid").write_bytes(valid)

    def once(data: bytes) -> None:
        path.write_bytes(data)
        fuzz.read_or_refused(read, path)

    path.write_bytes(valid)
    assert fuzz.read_or_refused(read, path), "what is valid is refused"
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    atheris.Setup([*sys.argv, "-timeout=100", "-rss_limit_mb=0", str(folder / "corpus")], once)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
