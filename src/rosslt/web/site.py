"""The page around viser's: the files that a browser gets for it."""

import http
import os
from typing import Dict, Optional, Tuple
from urllib.parse import parse_qs

from websockets.datastructures import Headers
from websockets.http11 import Response

#: The query of the view alone, which viser serves: `/?view`.
VIEW = 'view'

#: {path: the file behind it, and its type}
_FILES: Dict[str, Tuple[str, str]] = {
    '/': ('index.html', 'text/html'),
    '/source.js': ('source.js', 'text/javascript'),
    '/source.css': ('source.css', 'text/css'),
}

#: Nothing comes from elsewhere, and no other site shows the page in a frame.
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; frame-src 'self'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'self'"
)


def response(target: str) -> Optional[Response]:
    """The answer to a request for a file of the page; None if it is for none.

    Args:
        target: the path and the query, as `/?fixedDpr=0.5`.
    """
    path, _, query = target.partition('?')
    if path not in _FILES or VIEW in parse_qs(query, keep_blank_values=True):
        return None
    name, kind = _FILES[path]
    with open(os.path.join(os.path.dirname(__file__), 'static', name), 'rb') as file:
        body = file.read()
    headers = Headers(
        {
            'Content-Type': kind + '; charset=utf-8',
            'Content-Length': str(len(body)),
            'Content-Security-Policy': _POLICY,
            'Cache-Control': 'no-cache',
            'X-Content-Type-Options': 'nosniff',
        }
    )
    return Response(http.HTTPStatus.OK.value, http.HTTPStatus.OK.phrase, headers, body)
