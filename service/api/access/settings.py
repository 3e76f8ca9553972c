"""By which names may a server be called, from which pages, and does it ask for a token?

Who reaches a loopback address is on this machine, and could read the log's file without any server: no token is needed,
unless the server is told to ask for one (a proxy on this machine brings everybody). At any other address one is.
"""

import ipaddress
import re
from collections.abc import Collection

from msgspec import Struct

from service.errors import QueryError

LOOPBACK = frozenset({"localhost", "127.0.0.1", "::1"})
_ORIGIN = re.compile(r"https?://[a-z0-9.:\[\]-]+")


class Access(Struct, frozen=True):
    """Who may ask.

    Attributes
    ----------
    hosts : names and addresses by which the server may be called: a page of another name that leads here, as in DNS
        rebinding, is not from here.
    takes_addresses : also by any address in digits, as where it listens on all; no name leads to those.
    origins : of foreign pages that may ask and write, such as `https://desk.example`.
    needs_token : whether who has no token is refused.
    most_at_once : requests of one token, or of one address without a token, that are answered at the same time.
    """

    hosts: frozenset[str] = LOOPBACK
    takes_addresses: bool = False
    origins: tuple[str, ...] = ()
    needs_token: bool = False
    most_at_once: int = 200

    @classmethod
    def at(
        cls, address: str, *, hosts: Collection[str] = (), origins: Collection[str] = (), needs_token: bool = False
    ) -> "Access":
        """Say who may ask a server that listens on an address.

        Raises
        ------
        QueryError
            If an origin is none; `*` is refused, since any page could read the log then.

        Examples
        --------
        >>> Access.at("127.0.0.1").needs_token, Access.at("0.0.0.0").needs_token
        (False, True)
        """
        for origin in origins:
            if not _ORIGIN.fullmatch(origin):
                raise QueryError(f"--allow-origin: expected https://HOST or http://HOST:PORT, got {origin!r}")
        found = _address(address)
        is_local = found.is_loopback if found else address == "localhost"
        return cls(
            hosts=LOOPBACK | {address.lower(), *(one.lower() for one in hosts)},
            takes_addresses=found is not None and found.is_unspecified,
            origins=tuple(origins),
            needs_token=needs_token or not is_local,
        )

    def is_called(self, host: str) -> bool:
        """Tell whether a `Host` header names this server.

        Examples
        --------
        >>> [Access().is_called(one) for one in ("localhost:8420", "[::1]", "evil.example", "")]
        [True, True, False, False]
        """
        name = host[1:].partition("]")[0] if host.startswith("[") else host.partition(":")[0]
        return name.lower() in self.hosts or (self.takes_addresses and _address(name) is not None)

    def takes_writes(self, origin: str | None, host: str) -> bool:
        """Tell whether a page of this `Origin` may write; what is no page sends none."""
        return origin is None or origin.partition("://")[2] == host or origin in self.origins


def _address(name: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(name)
    except ValueError:
        return None
