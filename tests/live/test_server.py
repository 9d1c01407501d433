"""The page is for this machine, behind a secret path, and no file is served."""

import http.client
import json
import re
import socket
import struct
import subprocess
import sys
import threading
import time
from contextlib import closing, contextmanager, suppress
from urllib.parse import urlsplit

import numpy as np
import pytest

from inputdesign_cli.errors import Location, OutputError, SpecError
from inputdesign_cli.live.pages import Followed
from inputdesign_cli.live.server import Board, serving
from tests.support.browser import clipped, needs_browser, started, violations
from tests.support.pages import SPEC
from tests.support.processes import running

PAGE = '<!DOCTYPE html>\n<html lang="en"><body><main>one</main></body></html>'


@pytest.fixture
def served():
    board = Board()
    board.show(PAGE)
    with serving(board) as address:
        yield board, urlsplit(address)


def ask(address, path, method="GET", **headers):
    with closing(http.client.HTTPConnection(address.hostname, address.port, timeout=10)) as connection:
        connection.request(method, path, headers=headers)
        answer = connection.getresponse()
        return answer.status, answer.headers, answer.read().decode()


def test_the_page_has_its_version_and_a_policy_against_content_from_elsewhere(served):
    _, address = served
    status, headers, text = ask(address, address.path)
    assert (status, headers["Cache-Control"]) == (200, "no-store")
    assert '<html data-version="1" lang="en">' in text
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "'unsafe-inline'" not in policy.split("script-src")[1].split(";")[0]


def test_the_server_listens_on_the_loopback_interface_only(served):
    _, address = served
    assert address.hostname == "127.0.0.1"
    others = {found[4][0] for found in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}
    for other in others - {"127.0.0.1"}:
        if not other.startswith("127."):
            with (
                pytest.raises(ConnectionRefusedError),
                socket.create_connection((other, address.port), timeout=1),
            ):
                pass


HOSTS = ["evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:1", ""]
NOWHERE = ["/", "/x/", "{secret}x", "{secret}../", "{secret}../../../../etc/passwd", "//etc/passwd"]
NOWHERE += ["{secret}%2e%2e/etc/passwd", "{secret}result.json", "/etc/passwd"]


def test_other_names_of_the_machine_other_sites_and_files_are_refused(served):
    _, address = served
    for header in (*({"Host": host} for host in HOSTS), {"Sec-Fetch-Site": "cross-site"}):
        headers = {name: value.format(port=address.port) for name, value in header.items()}
        status, _, text = ask(address, address.path, **headers)
        assert status == 403, header
        assert "one" not in text
    for path in NOWHERE:
        status, _, text = ask(address, path.format(secret=address.path))
        assert (status, text) == (404, "there is nothing here\n"), path
    assert ask(address, address.path, Host=f"localhost:{address.port}")[0] == 200


def test_nothing_can_be_sent_and_head_has_no_body(served):
    _, address = served
    for method in ("POST", "PUT", "DELETE", "OPTIONS"):
        assert ask(address, address.path, method)[0] == 501
    status, headers, text = ask(address, address.path, "HEAD")
    assert (status, text) == (200, "")
    assert int(headers["Content-Length"]) > 0


def test_a_waiting_request_is_answered_as_soon_as_the_page_changes(served):
    board, address = served
    threading.Timer(0.3, board.show, [PAGE.replace("one", "two")]).start()
    started = time.monotonic()
    _, _, text = ask(address, f"{address.path}news?version=1")
    assert json.loads(text) == {"version": 2}
    assert 0.2 < time.monotonic() - started < 5.0
    assert "two" in ask(address, address.path)[2]
    for strange in ("", "0", "-3", "x", "9" * 50, "1&version=2"):
        assert json.loads(ask(address, f"{address.path}news?version={strange}")[2]) == {"version": 2}


def test_a_browser_that_disconnects_prints_nothing_in_the_terminal(served, capsys):
    """A closed tab leaves a waiting request for news behind."""
    board, address = served
    with socket.create_connection((address.hostname, address.port), timeout=10) as waiting:
        lines = f"GET {address.path}news?version=1 HTTP/1.1\r\nHost: {address.netloc}\r\n\r\n"
        waiting.sendall(lines.encode())
        time.sleep(0.2)
        waiting.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # a reset at once
    for _ in range(3):
        board.show(PAGE.replace("one", "more"))
        board.show(PAGE)
        time.sleep(0.1)
    assert ask(address, address.path)[0] == 200
    assert capsys.readouterr() == ("", "")


def test_a_port_that_is_taken_is_refused(served):
    _, address = served
    with pytest.raises(OutputError) as caught, serving(Board(), address.port):
        pass
    assert caught.value.diagnostics[0].code == "port-taken"


def malformed() -> list[bytes]:
    """Malformed requests: broken targets, versions and headers, and random bytes."""
    rng = np.random.default_rng(1)
    marks = [*rb"[ ] // % %zz @: #".split(), b"\x00", b"\xff", b"\x85", b"?version=\xb2", b" ", b"\t", b"\r"]
    targets = [
        *b"http://[::1 //[ http://]:x/ * http://[v1.x]/ http://a\xe2\x84\x80/".split(),
        b"",
        b"/" * 70000,
    ]
    targets += [b"http://" + b"".join(rng.choice(marks, 4)) + b"/" for _ in range(60)]
    requests = [b"GET " + target + b" HTTP/1.1\r\n\r\n" for target in targets]
    versions = [b"HTTP/1.\xb2", b"HTTP/9", b"HTTP/-1.1", b"HTTP/1.1.1", b"FTP/1.0", b"HTTP/2.0", b"HTTP/"]
    requests += [b"GET / " + version + b"\r\n\r\n" for version in versions]
    headers = [b"Host", b": x", b"Host: \xff\x00", b" folded", b"Content-Length: -1", b"Expect: 100-continue"]
    headers += [b"A: " + b"x" * 70000, b"\r\n".join(b"h%d: 1" % k for k in range(300))]
    headers += [b'Content-Type: multipart/mixed; boundary="', b"Sec-Fetch-Site: \xff"]
    requests += [b"GET / HTTP/1.1\r\n" + header + b"\r\n\r\n" for header in headers]
    requests += [rng.bytes(int(rng.integers(1, 200))) + b"\r\n\r\n" for _ in range(60)]
    return [*requests, b"\r\n\r\n", b"GET\r\n\r\n", b"GET / HTTP/1.1 x\r\n\r\n", b"TRACE / HTTP/1.1\r\n\r\n"]


def test_no_malformed_request_reaches_the_terminal(served, capsys):
    _, address = served
    for request in malformed():
        with (
            socket.create_connection((address.hostname, address.port), timeout=10) as client,
            suppress(ConnectionError),
        ):
            client.sendall(request)
            client.shutdown(socket.SHUT_WR)
            while client.recv(65536):
                pass
    assert ask(address, address.path)[0] == 200
    assert capsys.readouterr() == ("", "")


PATIENCE = 120.0


@contextmanager
def watching(path, *more, stderr=None):
    """The address of the page while `watch` runs; its messages go to the file `stderr`."""
    command = [sys.executable, "-m", "inputdesign_cli", "watch", str(path), *map(str, more)]
    with running(command, stdout=subprocess.PIPE, stderr=stderr, text=True, cwd=path.parent) as process:
        yield process.stdout.readline().strip()
        process.terminate()
        process.wait(30)


def page_with(address, part):
    """The page, once it has this part."""
    found, end = urlsplit(address), time.monotonic() + PATIENCE
    text = ""
    while time.monotonic() < end:
        with closing(http.client.HTTPConnection(found.hostname, found.port, timeout=30)) as connection:
            connection.request("GET", found.path)
            text = connection.getresponse().read().decode()
        if part in text:
            return text
        time.sleep(0.1)
    raise AssertionError(f"{part!r} never came; the page says {text[-3000:]}")


@pytest.fixture
def spec(tmp_path):
    path = tmp_path / "spec.yaml"
    path.write_text(SPEC % "")
    return path


def saved(spec, old, new):
    text = spec.read_text()
    assert old in text
    spec.write_text(text.replace(old, new))


def answers(text):
    return re.findall(r'<p class="answer">[^<]*?: cost ([0-9.e-]+)', text)


def test_a_saved_file_is_solved_and_shown_beside_the_last_good_design(spec, tmp_path):
    run = tmp_path / "run"
    with watching(spec, "-o", run, "--no-figures") as address:
        (first,) = answers(page_with(address, "The certificate"))
        assert (run / "result.json").is_file()
        saved(spec, "relative: 0.1", "relative: 0.2")
        text = page_with(address, "The one before")
        assert answers(text)[1] == first
        # Four times the variance is a quarter of the cost.
        assert float(answers(text)[0]) == pytest.approx(float(first) / 4, rel=1e-4)
        saved(spec, "relative: 0.2", "relativ: 0.2")
        text = page_with(address, "What is wrong")
        line = 1 + spec.read_text()[: spec.read_text().index("relativ:")].count("\n")
        assert f"spec.yaml, line {line}, column" in text
        assert re.search(rf"<mark> *{line} \| accuracy", text)
        assert "The last good design" in text
        assert answers(text)[1] == first


@pytest.mark.slow
def test_the_answer_precedes_its_pictures_and_every_round_has_a_terminal_line(spec, tmp_path):
    with (
        open(tmp_path / "told.txt", "w") as told,
        watching(spec, "-o", tmp_path / "run", "--no-figures", stderr=told) as address,
    ):
        (first,) = answers(page_with(address, "data:image/svg"))
        saved(spec, "relative: 0.1", "relative: 0.2")
        text = page_with(address, "its pictures are being drawn")
        assert answers(text)[1] == first
        page_with(address, " s.</p>")  # the pictures
        saved(spec, "relative: 0.2", "relativ: 0.2")
        page_with(address, "What is wrong")
        spec.unlink()
        assert "The last good design" in page_with(address, "file-missing")
        spec.write_text(SPEC % "")
        text = page_with(address, "Computed at")
        assert answers(text)[0] == first
        assert "What is wrong" not in text  # what has been mended is wrong no longer
    lines = (tmp_path / "told.txt").read_text()
    assert lines.index("Ctrl-C ends it") < lines.index("Computed at") < lines.index("[unknown-key]")
    assert "did you mean" in lines


def test_text_of_the_user_is_escaped_on_the_page():
    line = "a: '<script>alert(1)</script>'"
    wrong = SpecError.because("unknown-key", line, line, location=Location("s.yaml", 1, 1, line))
    text = Followed("<b>.yaml").failed(wrong, [line], "s.yaml").page
    assert "<script>alert" not in text
    assert text.count("&lt;script&gt;alert") == 3
    assert "&lt;b&gt;.yaml" in text
    assert "last good design" not in text  # where there has been none


@needs_browser
@pytest.mark.browser
@pytest.mark.slow
def test_a_browser_shows_each_saved_change_without_a_reload(spec, tmp_path):
    with watching(spec, "-o", tmp_path / "run", "--no-figures") as address, started() as browser:
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        faults = []
        page.on("console", lambda message: faults.append(message.text))
        page.goto(address)
        page.wait_for_selector(".state.done", timeout=1000 * PATIENCE)
        saved(spec, "relative: 0.1", "relative: 0.2")
        page.wait_for_selector("#design-2", timeout=1000 * PATIENCE)
        saved(spec, "relative: 0.2", "relativ: 0.2")
        page.wait_for_selector("mark", timeout=1000 * PATIENCE)
        assert faults == []
        tops = """() => [...document.querySelectorAll(".level > section")].map(
            (each) => each.querySelector("figure").getBoundingClientRect().top)"""
        before, after = page.evaluate(tops)
        assert before == after
        # A script judges the page; the policy of the server would forbid it.
        other = browser.new_page(viewport={"width": 400, "height": 900})
        other.set_content(page.content().replace('<script src="follow.js" defer=""></script>', ""))
        assert violations(other) == []
        assert clipped(other) == []
