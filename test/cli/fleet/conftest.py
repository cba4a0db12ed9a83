# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A web server on this machine, some of whose files are not what they should be."""

import functools
import gzip
import threading
import time
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest

PACKED = gzip.compress(b'<a href="rgb.txt">x</a>' + bytes(2 ** 20))


class Handler(SimpleHTTPRequestHandler):
    """
    Serves a folder, but for names with another beginning.

    ``cut`` ends too early, ``endless`` never, ``short`` is smaller than announced, ``broken`` an
    error of the server, ``silent`` never answered, ``slow`` comes byte by byte,
    ``stops`` after 100 bytes, ``interim-N`` is
    empty after N interim answers, ``packed`` is sent as gzip, and ``nested`` a folder with one
    like itself in it. The first ``overloads`` requests are refused.
    """

    protocol_version = 'HTTP/1.1'

    def do_GET(self):
        self.server.requests.append(self.path)
        self.server.encodings.add(self.headers['Accept-Encoding'])
        name = self.path.rpartition('/')[2]
        if self.server.overloads > 0:
            self.server.overloads -= 1
            self.send_error(503)
        elif name.startswith('broken'):
            self.send_error(503)
        elif name.startswith('interim-'):
            self.wfile.write(b'HTTP/1.1 102 Processing\r\n\r\n' * int(name.partition('-')[2]))
            self._send('Content-Length', '0')
        elif 'silent' in self.path:
            self._drip(b'')
        elif 'slow' in self.path:
            self._send('Content-Length', '1000')
            self._drip(b'<')
        elif 'packed' in self.path:
            self._send_packed()
            self.wfile.write(PACKED)
        elif 'nested' in self.path:
            page = b'<a href="nested/">nested</a>'
            self._send('Content-Length', str(len(page)))
            self.wfile.write(page)
        elif name.startswith('cut'):
            self._send('Content-Length', '1000')
            self.wfile.write(bytes(100))
            self.close_connection = True
        elif name.startswith('stops'):
            self._send('Content-Length', '1000')
            self.wfile.write(bytes(100))
            self._drip(b'')
        elif name.startswith('short'):
            self._send('Content-Length', '4')
            self.wfile.write(bytes(4))
        elif name.startswith('endless'):
            self._send('Transfer-Encoding', 'chunked')
            self.close_connection = True
            with_size = b'10000\r\n' + bytes(2 ** 16) + b'\r\n'
            try:
                while not self.server.is_closed:
                    self.wfile.write(with_size)
            except OSError:
                pass  # the client has seen enough
        else:
            super().do_GET()

    def _drip(self, byte):
        self.close_connection = True
        try:
            while not self.server.is_closed:
                self.wfile.write(byte)
                time.sleep(0.01)
        except OSError:
            pass  # the client has waited enough

    def do_HEAD(self):
        name = self.path.rpartition('/')[2]
        self.server.encodings.add(self.headers['Accept-Encoding'])
        self.server.heads.append(self.path)
        if not self.server.knows_head:
            self.send_error(501)
        elif 'silent' in self.path:
            self._drip(b'')
        elif name.startswith('broken'):
            self.send_error(503)
        elif name.startswith(('cut', 'slow', 'stops')):
            self._send('Content-Length', '1000')
        elif 'packed' in self.path:
            self._send_packed()
        elif name.startswith(('endless', 'short')):
            self._send('Content-Length', '10')
        else:
            super().do_HEAD()

    def _send(self, *header):
        self._send_all(header)

    def _send_packed(self):
        self._send_all(('Content-Encoding', 'gzip'), ('Content-Length', str(len(PACKED))))

    def _send_all(self, *headers):
        self.send_response(200)
        for header in headers:
            self.send_header(*header)
        self.end_headers()

    def log_message(self, *_):
        pass


@pytest.fixture
def web(tmp_path):
    """Return a server of the folder ``tmp_path/web``; ``url`` is its address."""
    pytest.importorskip('aiohttp', reason="no URLs: pip install '.[fleet]'")
    folder = tmp_path / 'web'
    folder.mkdir()
    server = ThreadingHTTPServer(('127.0.0.1', 0),
                                 functools.partial(Handler, directory=str(folder)))
    server.daemon_threads, server.requests, server.is_closed = True, [], False
    server.knows_head = True
    server.overloads, server.heads, server.encodings = 0, [], set()
    server.folder, server.url = folder, f'http://127.0.0.1:{server.server_port}'
    thread = threading.Thread(target=server.serve_forever, args=(0.02,))
    thread.start()
    yield server
    server.is_closed = True
    server.shutdown()
    server.server_close()
    thread.join()
