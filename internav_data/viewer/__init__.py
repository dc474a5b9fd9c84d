"""Page of a dataset: statistics, a gallery to filter, and each episode with its outcomes.

`serve` answers a browser on this machine, `write_page` writes a sample as one HTML file. Both show
the same page (`static/`) and answer its questions by the same table (`routes`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.lazy import lazy_imports

if TYPE_CHECKING:
    from internav_data.viewer.routes import Response, respond
    from internav_data.viewer.server import ViewerServer, serve
    from internav_data.viewer.single_file import write_page
    from internav_data.viewer.viewed import ViewedDataset

__all__ = ["Response", "ViewedDataset", "ViewerServer", "respond", "serve", "write_page"]

# The server answers before it has what draws pictures.
__getattr__, __dir__ = lazy_imports(
    __name__,
    {
        "routes": ["Response", "respond"],
        "server": ["ViewerServer", "serve"],
        "single_file": ["write_page"],
        "viewed": ["ViewedDataset"],
    },
)
