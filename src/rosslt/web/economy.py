"""What a browser that draws with the processor does without, so that the page stays fluent there.

viser's client asks for smooth edges (multisampling), and has no setting for it; and it draws all pixels, however long
that takes. Without a graphics card a frame costs as much as its pixels. So a script at the head of the page, which runs
before viser's, asks for plain edges where the browser names something that draws with the processor, and has fewer
pixels drawn there while things move and frames take too long. WebGL's own question for it,
`failIfMajorPerformanceCaveat`, is no help: a Chromium that was told to draw so says that all is well.
"""

import functools
import gzip
from pathlib import Path
from typing import Any

SCRIPT = b'<script>\n%s</script>' % Path(__file__).with_name('economy.js').read_bytes()

#: Before which part of a page the script stands.
BEFORE = b'<meta charset="utf-8"'


def add_script(response: Any) -> None:
    """Add the script to the answer to a request, if this answer is the page; as of `websockets.http11`."""
    if response.headers.get('Content-Type', '').startswith('text/html'):
        response.body = _with_script(response.body, response.headers.get('Content-Encoding') == 'gzip')
        del response.headers['Content-Length']
        response.headers['Content-Length'] = str(len(response.body))


@functools.lru_cache(maxsize=2)
def _with_script(body: bytes, is_compressed: bool) -> bytes:
    page = gzip.decompress(body) if is_compressed else body
    page = page.replace(BEFORE, SCRIPT + BEFORE, 1)
    return gzip.compress(page) if is_compressed else page
