"""The page of the interface comes whole from this server, and its own policy lets it load nothing else."""

import base64
import hashlib
import re
from collections.abc import Iterator

import pytest

from service.api.app import create_app
from tests.service.http import Client
from tests.service.logs import overtake, write_log


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with Client(create_app(write_log(tmp_path_factory.mktemp("docs") / "a.db", [overtake()]), shipped=[])) as client:
        yield client


def test_every_file_of_the_page_comes_from_this_server(client: Client) -> None:
    page = client.get("/docs")
    assert page.headers["content-type"] == "text/html; charset=utf-8"
    files = re.findall(r"(?:src|href)=\"(.*?)\"|url: '(.*?)'", page.text)
    kinds = {name: client.get(f"/{name}").headers["content-type"] for pair in files for name in pair if name}
    assert kinds == {
        "docs/swagger-ui.css": "text/css; charset=utf-8",
        "docs/favicon.png": "image/png",
        "docs/swagger-ui-bundle.js": "text/javascript; charset=utf-8",
        "openapi.json": "application/json",
    }
    assert re.findall(r"@import|url\(\"?(?!\"?data:)", client.get("/docs/swagger-ui.css").text) == []


def test_the_policy_of_the_page_allows_its_own_script_and_no_other(client: Client) -> None:
    page = client.get("/docs")
    policy = dict(one.split(" ", 1) for one in page.headers["content-security-policy"].split("; "))
    inline = [text for text in re.findall(r"<script[^>]*>(.*?)</script>", page.text, re.DOTALL) if text]
    digests = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in inline]
    assert policy["script-src"] == f"'self' 'sha256-{digests[0]}'"
    assert len(digests) == 1
    assert policy["default-src"] == "'none'"
    assert re.findall(r"<style|\sstyle=|\son\w+=", page.text) == []


def test_the_page_is_no_part_of_the_described_interface(client: Client) -> None:
    assert [path for path in client.get("/openapi.json").json()["paths"] if path.startswith("/docs")] == []
    assert client.request("POST", "/docs").json()["detail"] == "/docs: expected method GET or HEAD, got 'POST'"
    assert client.get("/docs/nothing.js").headers["content-type"] == "application/problem+json"
