"""A store that is a dictionary."""

from __future__ import annotations

import contextlib
import io

from internav_data.core.storage import temporary_of


class KilledError(Exception):
    """The process that wrote has died."""


class MemoryStore:
    """Blobs by name; dies at the change of number `deadline`, counted from 0.

    As a folder does, it then keeps half of a blob that was being put, under its temporary name.
    """

    def __init__(self, blobs=None, deadline=None):
        self.blobs = dict(blobs or {})
        self.deadline, self.changes = deadline, 0
        self.log = []

    def at(self, name):
        return f"memory:{name}"

    def size(self, name):
        return len(self._blob(name))

    def read(self, name, start=0, stop=None):
        return self._blob(name)[start:stop]

    def source(self, name):
        return io.BytesIO(self._blob(name))

    def put(self, name, data, *, beside=""):
        if beside:
            self._blob(beside)
        if self.changes == self.deadline:
            self.blobs.setdefault(temporary_of(name), bytes(data[: len(data) // 2]))
        self._change("put", name)
        self.blobs[name] = bytes(data)

    def names(self, prefix=""):
        return sorted(name for name in self.blobs if name.startswith(prefix))

    def remove(self, name):
        if name in self.blobs:
            self._change("remove", name)
            del self.blobs[name]

    def prune(self, prefix):
        """Do nothing: there are no folders."""

    @contextlib.contextmanager
    def lock(self, busy):  # noqa: ARG002 - a process shares it with none
        yield

    def _blob(self, name):
        if name not in self.blobs:
            raise FileNotFoundError(2, "No such blob", name)
        return self.blobs[name]

    def _change(self, kind, name):
        if self.changes == self.deadline:
            raise KilledError
        self.changes += 1
        self.log.append((kind, name))
