"""What a browser that draws with the processor does without, so that the page stays fluent there.

viser's client asks for smooth edges (multisampling), and has no setting for it. Without a graphics card they cost a
good part of each frame. So a script at the head of the page, which runs before viser's, asks for plain edges where the
browser names something that draws with the processor. WebGL's own question for it, `failIfMajorPerformanceCaveat`, is
no help: a Chromium that was told to draw so says that all is well.
"""

import functools
import gzip
from typing import Any

SCRIPT = b"""<script>
(() => {
  const getContext = HTMLCanvasElement.prototype.getContext;
  let isSlow;
  const drawsWithProcessor = () => {
    const probe = getContext.call(document.createElement('canvas'), 'webgl2');
    const names = probe?.getExtension('WEBGL_debug_renderer_info');
    const name = names ? probe.getParameter(names.UNMASKED_RENDERER_WEBGL) : '';
    probe?.getExtension('WEBGL_lose_context')?.loseContext();
    return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
  };
  HTMLCanvasElement.prototype.getContext = function (kind, wishes) {
    if (kind === 'webgl2' && wishes?.antialias) {
      isSlow ??= drawsWithProcessor();
      if (isSlow) wishes = {...wishes, antialias: false};
    }
    return getContext.call(this, kind, wishes);
  };
})();
</script>"""

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
