"""Who reaches the page, and who does not."""

import base64
import http.client

import pytest

from support.browser import Server, python_path
from support.shell import rosslt

pytestmark = pytest.mark.rostest

SECRET = 'a b: c'


@pytest.fixture(scope='module')
def locked(master, tmp_path_factory):
    """A page that asks for a password."""
    file = tmp_path_factory.mktemp('password') / 'file'
    file.write_text(SECRET + '\n', encoding='utf-8')
    started = Server('__name:=locked', '--password-file', str(file))
    yield started
    started.stop()


def answer(server, path='/', **headers):
    """The status and the headers of the answer to a request."""
    connection = http.client.HTTPConnection('127.0.0.1', server.port, timeout=30)
    connection.request('GET', path, headers={name.replace('_', '-'): value for name, value in headers.items()})
    response = connection.getresponse()
    found = response.status, dict(response.getheaders())
    connection.close()
    return found


def handshake(server, path='/', **headers):
    """The status of a request for the connection that changes are sent by."""
    return answer(
        server,
        path,
        Connection='Upgrade',
        Upgrade='websocket',
        Sec_WebSocket_Version='13',
        Sec_WebSocket_Key=base64.b64encode(b'0' * 16).decode(),
        **headers,
    )[0]


def basic(password):
    return 'Basic ' + base64.b64encode('anybody:{}'.format(password).encode()).decode()


def test_this_machine_gets_in(page):
    assert answer(page)[0] == 200
    assert handshake(page) == 101
    assert handshake(page, Origin='http://127.0.0.1:{}'.format(page.port)) == 101


def test_another_site_in_the_same_browser_does_not(page):
    assert handshake(page, Origin='https://evil.example') == 403
    assert handshake(page, Origin='null') == 403
    assert answer(page, Host='evil.example')[0] == 403, 'a name that was pointed at this machine'


@pytest.mark.parametrize('headers', [{'Host': '['}, {'Origin': 'http://['}, {'Host': '[x]'}])
def test_what_is_no_address_is_refused(page, headers):
    assert answer(page, **headers)[0] == 400


@pytest.mark.parametrize('path', ['/', '/?view', '/source.js', '/source.css'])
def test_all_files_are_checked_alike(page, locked, path):
    assert answer(page, path)[0] == 200
    assert answer(page, path, Origin='https://evil.example')[0] == 403
    assert answer(page, path, Host='evil.example')[0] == 403
    assert answer(locked, path)[0] == 401
    assert answer(locked, path, Authorization=basic(SECRET))[0] == 200


def test_the_connection_of_the_source_is_checked_alike(page, locked):
    assert handshake(page, '/source') == 101
    assert handshake(page, '/source', Origin='https://evil.example') == 403
    assert handshake(page, '/source', Host='evil.example') == 403
    assert handshake(locked, '/source') == 401
    assert handshake(locked, '/source', Authorization=basic(SECRET)) == 101


def test_the_page_takes_nothing_from_elsewhere(page):
    policy = answer(page)[1]['Content-Security-Policy']
    assert "default-src 'none'" in policy
    assert "script-src 'self'" in policy
    assert "frame-ancestors 'self'" in policy


def test_a_tunnel_may_have_another_port(page):
    assert handshake(page, Host='localhost:9999', Origin='http://localhost:9999') == 101


def test_a_password_is_asked_for(locked):
    status, headers = answer(locked)
    assert status == 401
    assert headers['WWW-Authenticate'].startswith('Basic')
    assert handshake(locked) == 401


@pytest.mark.parametrize('given', ['Basic ?', 'Basic', 'Bearer x', basic('wrong'), basic(''), 'Basic ' + 'w6k='])
def test_nothing_else_gets_in(locked, given):
    assert answer(locked, Authorization=given)[0] == 401
    assert answer(locked, Cookie='rosslt=wrong')[0] == 401


def test_the_password_gets_in_and_need_not_be_given_again(locked):
    status, headers = answer(locked, Authorization=basic(SECRET))
    assert status == 200
    cookie = headers['Set-Cookie']
    assert 'HttpOnly' in cookie
    assert 'SameSite=Strict' in cookie
    assert handshake(locked, Cookie=cookie.partition(';')[0]) == 101


def web(*arguments):
    return rosslt('web', *arguments, PYTHONPATH=python_path())


def test_another_address_needs_a_password_or_a_word(master, tmp_path):
    found = web('--host', '0.0.0.0', '--port', '0')
    assert found.returncode == 1
    assert '--password-file' in found.stderr
    assert '--no-password' in found.stderr
    empty = tmp_path / 'empty'
    empty.write_text('\n', encoding='utf-8')
    assert 'is empty' in web('--password-file', str(empty)).stderr
    assert 'cannot read the password' in web('--password-file', str(tmp_path / 'none')).stderr


def test_a_port_in_use_is_said(page):
    found = web('--port', str(page.port))
    assert found.returncode == 1
    assert 'cannot listen at 127.0.0.1 port {}'.format(page.port) in found.stderr
    assert page.process.poll() is None, 'the page that is there stays'


def test_without_viser_it_says_how_to_install_it(master):
    found = rosslt('web')
    assert found.returncode == 1
    assert 'pip install viser' in found.stderr
    assert 'Traceback' not in found.stderr
