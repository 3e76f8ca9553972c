"""A camera as it is bought: RTSP 1.0 (RFC 2326) over TCP, MPEG-TS in RTP (RFC 2250), a login by digest (RFC 2617)."""

import hashlib
import re
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

PACKETS = 188 * 7  # of MPEG-TS in one of RTP
_SDP = "v=0\r\no=- 1 1 IN IP4 127.0.0.1\r\ns=camera\r\nt=0 0\r\nm=video 0 RTP/AVP 33\r\na=control:track1\r\n"
_REALM, _NONCE = "camera", "5ccc069c403ebaf9f0171e9517f40e41"


@contextmanager
def rtsp_camera(*visits: bytes, login: str = "", bytes_per_s: float = 0.0, cuts_line: bool = True) -> Iterator[str]:
    """Send MPEG-TS to whoever plays `/1`, and cut the line after each visit; stay silent in the last one.

    Parameters
    ----------
    visits : what is sent; each is over before the next one may play.
    login : user:password, which it asks for; empty if it asks for none.
    bytes_per_s : how fast it sends; 0 for as fast as the line takes it.
    cuts_line : False to stay silent after each.

    Yields
    ------
    Its address without a login: rtsp://127.0.0.1:PORT/1.
    """
    server = socket.create_server(("127.0.0.1", 0))
    left, lines, threads = list(visits), list[socket.socket](), list[threading.Thread]()

    def answer() -> None:
        with suppress(OSError):
            while True:
                lines.append(server.accept()[0])
                threads.append(threading.Thread(target=_Line(lines[-1], left, login, bytes_per_s, cuts_line).serve))
                threads[-1].start()

    accepting = threading.Thread(target=answer)
    accepting.start()
    yield f"rtsp://127.0.0.1:{server.getsockname()[1]}/1"
    server.shutdown(socket.SHUT_RDWR)
    server.close()
    accepting.join()
    for line in lines:
        with suppress(OSError):
            line.shutdown(socket.SHUT_RDWR)
    for thread in threads:
        thread.join()
    for line in lines:
        line.close()


class _Line:
    """One caller: requests are read while packets are sent on the same line."""

    def __init__(self, line: socket.socket, left: list[bytes], login: str, bytes_per_s: float, cuts: bool) -> None:
        self._line, self._left, self._login, self._bytes_per_s, self._cuts = line, left, login, bytes_per_s, cuts
        self._sending = threading.Lock()  # answers and packets do not mix

    def serve(self) -> None:
        """Answer until the line is closed."""
        with suppress(OSError, EOFError), self._line.makefile("rb") as came:
            while True:
                first = _exactly(came.read(1), 1)
                if first == b"$":  # a report of the receiver, of RTCP
                    _, size = struct.unpack(">BH", _exactly(came.read(3), 3))
                    came.read(size)
                    continue
                head = first + b"".join(iter(came.readline, b"\r\n"))
                self._answer(head.decode())

    def _answer(self, head: str) -> None:
        method, url, _ = head.split(" ", 2)
        fields = {name.lower(): value for name, value in re.findall(r"^([\w-]+): *(.*?)\r$", head, re.MULTILINE)}
        if method != "OPTIONS" and self._login and not self._knows(method, fields.get("authorization", "")):
            said = f'WWW-Authenticate: Digest realm="{_REALM}", nonce="{_NONCE}"'
            self._say(fields, "401 Unauthorized", said)
        elif method == "OPTIONS":
            self._say(fields, "200 OK", "Public: OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN")
        elif not re.fullmatch(r"rtsp://[^/]+/1(/.*)?", url):
            self._say(fields, "404 Not Found")
        elif method == "DESCRIBE":
            self._say(fields, "200 OK", f"Content-Base: {url}/", "Content-Type: application/sdp", body=_SDP)
        elif method == "SETUP" and "RTP/AVP/TCP" not in fields["transport"]:
            self._say(fields, "461 Unsupported Transport")
        elif method == "SETUP":
            self._say(fields, "200 OK", "Transport: RTP/AVP/TCP;unicast;interleaved=0-1")
        else:
            self._say(fields, "200 OK")
            if method == "PLAY":
                threading.Thread(target=self._send, daemon=True).start()
            elif method == "TEARDOWN":
                raise EOFError

    def _knows(self, method: str, said: str) -> bool:
        user, password = self._login.split(":")
        given = dict(re.findall(r'(\w+)="([^"]*)"', said))
        secret, asked = _md5(f"{user}:{_REALM}:{password}"), _md5(f"{method}:{given.get('uri')}")
        return given.get("response") == _md5(f"{secret}:{_NONCE}:{asked}")

    def _say(self, fields: dict[str, str], status: str, *more: str, body: str = "") -> None:
        lines = [f"RTSP/1.0 {status}", f"CSeq: {fields['cseq']}", "Session: 12345678;timeout=60", *more]
        lines += [f"Content-Length: {len(body)}"] if body else []
        with self._sending:
            self._line.sendall("\r\n".join([*lines, "", body]).encode())

    def _send(self) -> None:
        data, began_s = self._left.pop(0) if self._left else b"", time.monotonic()
        with suppress(OSError):
            for number, at in enumerate(range(0, len(data), PACKETS)):
                part = data[at : at + PACKETS]
                ticks = round(90_000 * (time.monotonic() - began_s))
                packet = struct.pack(">BBHII", 0x80, 33, number & 0xFFFF, ticks, 1) + part
                if self._bytes_per_s:
                    time.sleep(max(0.0, began_s + at / self._bytes_per_s - time.monotonic()))
                with self._sending:
                    self._line.sendall(struct.pack(">cBH", b"$", 0, len(packet)) + packet)
            if self._left and self._cuts:
                self._line.shutdown(socket.SHUT_RDWR)


def _exactly(data: bytes, size: int) -> bytes:
    if len(data) < size:
        raise EOFError
    return data


def _md5(text: str) -> str:
    return hashlib.md5(text.encode()).hexdigest()  # as the protocol has it
