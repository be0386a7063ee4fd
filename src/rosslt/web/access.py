"""Access to the page: every request is checked before the page sees it.

Whoever reaches the page can change what a robot does. So it listens on this machine only unless another address is
named, and then asks for a password. A web site that is open in the same browser must not reach it either: a browser
says from which site a request comes (Origin), and under which name the page is addressed (Host), which a site could
have pointed at this machine.
"""

import asyncio
import base64
import binascii
import contextlib
import hmac
import http
import ipaddress
import secrets
import socket
from http.cookies import CookieError, SimpleCookie
from typing import Any, Iterator, Optional, Protocol
from urllib.parse import urlsplit

import websockets.asyncio.server
from websockets.datastructures import Headers
from websockets.http11 import Response

#: The cookie of those who have given the password.
COOKIE = 'rosslt'

#: The delay of the answer to a wrong password, in seconds.
WRONG_PASSWORD_DELAY = 1.0


class NotServed(Exception):
    """The page cannot be served; says why, and what to do."""


class AccessCheck:
    """The check of requests.

    Args:
        host: the address that the page listens at.
        password: what has to be given, or None for a page that is open to whoever reaches it.
    """

    def __init__(self, host: str, password: Optional[str]) -> None:
        self._password, self._token = password, secrets.token_urlsafe(32)
        self._names = {'localhost', host.lower(), socket.gethostname().lower(), socket.getfqdn().lower()}

    def refusal(self, headers: Any) -> Optional[Response]:
        """The answer to a request that is not let in, or None for one that is.

        Args:
            headers: of the request.
        """
        address, origin = headers.get('Host', ''), headers.get('Origin')
        try:
            name, site = urlsplit('//' + address).hostname or '', urlsplit(origin or '').netloc
        except ValueError as error:
            return _answer(http.HTTPStatus.BAD_REQUEST, 'Host or Origin is not an address: {}'.format(error))
        if origin is not None and site.lower() != address.lower():
            return _answer(http.HTTPStatus.FORBIDDEN, 'this page is not for other sites, such as {}'.format(origin))
        if self._password is None:
            if name not in self._names and not _is_number(name):
                return _answer(http.HTTPStatus.FORBIDDEN, 'this page is not known as {}'.format(name))
        elif not self._has_cookie(headers) and not self.has_password(headers):
            refused = _answer(http.HTTPStatus.UNAUTHORIZED, 'this page asks for a password')
            refused.headers['WWW-Authenticate'] = 'Basic realm="rosslt", charset="UTF-8"'
            return refused
        return None

    def has_password(self, headers: Any) -> bool:
        """Return whether a request comes with the right password; with any name."""
        kind, _, given = headers.get('Authorization', '').partition(' ')
        if self._password is None or kind.lower() != 'basic':
            return False
        try:
            _, _, password = base64.b64decode(given, validate=True).decode('utf-8').partition(':')
        except (binascii.Error, UnicodeDecodeError):
            return False
        return hmac.compare_digest(password.encode(), self._password.encode())

    def cookie(self) -> str:
        """Make the cookie that a browser sends from now on, once it has given the password."""
        return '{}={}; HttpOnly; SameSite=Strict; Path=/'.format(COOKIE, self._token)

    def _has_cookie(self, headers: Any) -> bool:
        try:
            found = SimpleCookie(headers.get('Cookie', '')).get(COOKIE)
        except CookieError:
            return False
        return found is not None and hmac.compare_digest(found.value.encode(), self._token.encode())


class Site(Protocol):
    """What the server has besides viser's page."""

    def response(self, target: str) -> Optional[Response]:
        """The answer to a request for a path, with its query, as `/?view`; None if viser has to answer."""

    def talks_at(self, target: str) -> bool:
        """Return whether `talk` serves the connections that are opened at a path."""

    async def talk(self, connection: Any) -> None:
        """Serve a connection until it ends."""


@contextlib.contextmanager
def guarded(access: AccessCheck, site: Site) -> Iterator[None]:
    """Have the server that viser starts in this context check every request, and serve a site of ours besides.

    viser 1.1 has no way to say it: its call of `websockets.asyncio.server.serve` is given one more step.

    Args:
        access: the check.
        site: what is there besides viser's page.

    Raises:
        NotServed: viser has started no server in that way; then nothing may be served.
    """
    serve = websockets.asyncio.server.serve
    started = []

    def guarded_serve(handler: Any, *arguments: object, process_request: Any, **options: object) -> Any:
        async def checked(connection: Any, request: Any) -> Any:
            refused = access.refusal(request.headers)
            if refused is not None:
                if 'Authorization' in request.headers:
                    await asyncio.sleep(WRONG_PASSWORD_DELAY)
                return refused
            is_connection = request.headers.get('Upgrade', '').lower() == 'websocket'
            response = None if is_connection else site.response(request.path)
            response = response or process_request(connection, request)
            if response is not None and access.has_password(request.headers):
                response.headers['Set-Cookie'] = access.cookie()
            return response

        async def connected(connection: Any) -> None:
            await (site.talk if site.talks_at(connection.request.path) else handler)(connection)

        started.append(True)
        return serve(connected, *arguments, process_request=checked, **options)

    websockets.asyncio.server.serve = guarded_serve
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve
    if not started:
        raise NotServed('this version of viser starts its server in another way, which cannot be guarded')


def is_this_machine(host: str) -> bool:
    """Return whether an address is reached from this machine alone."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == 'localhost'


def check_address(host: str, port: int) -> None:
    """See that a server can listen at an address.

    Raises:
        NotServed: it cannot.
    """
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        family, kind, protocol, _, address = found[0]
        with socket.socket(family, kind, protocol) as attempt:
            attempt.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            attempt.bind(address)
    except (OSError, OverflowError) as error:
        raise NotServed('cannot listen at {} port {}: {}'.format(host, port, error)) from None


def read_password(path: str) -> str:
    """The password in a file: its first line.

    Raises:
        NotServed: there is none.
    """
    try:
        with open(path, encoding='utf-8') as file:
            password = file.readline().rstrip('\r\n')
    except (OSError, UnicodeDecodeError) as error:
        raise NotServed('cannot read the password from {}: {}'.format(path, error)) from None
    if not password:
        raise NotServed('the first line of {} is empty: write the password there'.format(path))
    return password


def _is_number(name: str) -> bool:
    """Return whether a host is named by its address, as no site can be that points its own name elsewhere."""
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _answer(status: http.HTTPStatus, text: str) -> Response:
    body = (text + '\n').encode()
    headers = Headers({'Content-Type': 'text/plain; charset=utf-8', 'Content-Length': str(len(body))})
    return Response(status.value, status.phrase, headers, body)
