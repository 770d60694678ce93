"""Each guard of the page taken out, one at a time, in a copy of the sources: does its test fail then?

    python -m tests.benchmarks.guards_removed [--only WORD] [--browser]

Printed: the guard, the test that must fail without it, and whether it does. First all these tests run on the sources as
they are, and must pass. With --browser also the guards whose tests need Chromium. The exit code is 1 where a guard can
go unnoticed.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from tests.benchmarks.frame import Namespace, benchmark

TOP = Path(__file__).parents[2]
LIVE = "fingervision/live"
COPIED = ("fingervision", "calib", "tests", "sample_frames", "pyproject.toml")
PATIENCE_S = 300.0
ATTACKS, STRANGERS, GUARD = "test_attacks", "test_strangers", "test_guard"


@dataclass(frozen=True, slots=True)
class Guarded:
    """A guard: where it stands, what is put in its place, and the test that must see it.

    Parameters
    ----------
    name : str
        What is guarded against.
    file : str
        Path of the source, from the top.
    stands, instead : str
        Text of the guard, and what is put there.
    test : str
        File of the test, without its ending; with a folder where it is not that of the live view.
    words : str
        Part of the test's name.
    """

    name: str
    file: str
    stands: str
    instead: str
    test: str
    words: str

    @property
    def tests(self) -> list[str]:
        """Arguments of pytest that choose the test."""
        path = self.test if "/" in self.test else f"live/{self.test}"
        return [f"tests/{path}.py", "-k", self.words]


GUARDS = (
    Guarded(
        "foreign Host (rebinding)", f"{LIVE}/guard.py", 'if not self._is_ours(headers.get("host", "")):', "if False:",
        ATTACKS, "name_that_is_pointed_here",
    ),
    Guarded(
        "foreign Origin", f"{LIVE}/guard.py",
        """if origin is not None and origin != f"{self._scheme}://{headers.get('host', '')}":""", "if False:",
        ATTACKS, "foreign_page_opens_no_socket",
    ),
    Guarded(
        "missing Origin", f"{LIVE}/guard.py", 'if origin is None and scope["type"] == "websocket":', "if False:",
        ATTACKS, "foreign_page_opens_no_socket",
    ),
    Guarded(
        "missing token", f"{LIVE}/guard.py", "if not roles:",
        'roles = roles or ([] if given else ["writer"])\n        if not roles:',
        ATTACKS, "missing_stale_and_guessed",
    ),
    Guarded(
        "guessed beginning of a token", f"{LIVE}/guard.py", "if hmac.compare_digest(given.encode(), token.encode())]",
        "if given and token.startswith(given)]", ATTACKS, "missing_stale_and_guessed",
    ),
    Guarded(
        "stale token", f"{LIVE}/guard.py", "if hmac.compare_digest(given.encode(), token.encode())]",
        "if len(given) == len(token) and given.swapcase() != token]", ATTACKS, "missing_stale_and_guessed",
    ),
    Guarded(
        "token's file open to others", f"{LIVE}/server.py", "os.O_EXCL, 0o600)", "os.O_EXCL, 0o644)",
        ATTACKS, "token_is_its_users_alone",
    ),
    Guarded(
        "token that others could read", f"{LIVE}/server.py", " and path.stat().st_mode & 0o077 == 0", "",
        ATTACKS, "token_is_its_users_alone",
    ),
    Guarded(
        "token in logs", f"{LIVE}/server.py", 'log_level="critical",\n                access_log=False,',
        'log_level="info",\n                access_log=True,', ATTACKS, "token_is_in_no_log",
    ),
    Guarded(
        "token in referrers", f"{LIVE}/guard.py", '    "Referrer-Policy": "no-referrer",\n', "",
        ATTACKS, "token_is_in_no_log",
    ),
    Guarded(
        "token on the browser's command line", f"{LIVE}/server.py", "os.O_EXCL, 0o600)", "os.O_EXCL, 0o644)",
        STRANGERS, "browser_is_opened_without",
    ),
    Guarded(
        "path traversal to a file", f"{LIVE}/server.py", 'Route("/page/{name}", self._file)',
        'Route("/page/{name:path}", lambda request: FileResponse(PAGE / request.path_params["name"]))',
        ATTACKS, "no_name_leads_out",
    ),
    Guarded(
        "path traversal to a picture", f"{LIVE}/server.py",
        "picture = pictures.get(request.path_params[\"number\"])",
        "picture = (PAGE / request.path_params[\"number\"]).read_bytes()", ATTACKS, "no_name_leads_out",
    ),
    Guarded(
        "settings from anywhere", f"{LIVE}/commands/set_up.py", "if not any(path.is_relative_to(folder.resolve())",
        "if False and not any(path.is_relative_to(folder.resolve())", "test_set_up", "settings",
    ),
    Guarded(
        "recipe from anywhere", f"{LIVE}/commands/bed.py", "if not any(path.is_relative_to(folder.resolve())",
        "if False and not any(path.is_relative_to(folder.resolve())", "test_bench", "may_not_do",
    ),
    Guarded(
        "oversized message", f"{LIVE}/server.py", "ws_max_size=MESSAGE_BYTES,", "", ATTACKS, "oversized_message",
    ),
    Guarded(
        "flood of messages", f"{LIVE}/page_socket.py", "MESSAGES_A_SECOND, MOST_DIGITS = 120, 12",
        "MESSAGES_A_SECOND, MOST_DIGITS = 10**6, 12", ATTACKS, "oversized_message",
    ),
    Guarded(
        "message that is no JSON", f"{LIVE}/page_socket.py", "except (ValueError, RecursionError):", "except KeyError:",
        ATTACKS, "malformed_messages",
    ),
    Guarded(
        "message that is no request", f"{LIVE}/page_socket.py", "return request if isinstance(request, dict) else {}",
        "return request", ATTACKS, "malformed_messages",
    ),
    Guarded(
        "number without end", f"{LIVE}/commands/asking.py",
        "isinstance(value, int | float) and abs(value) <= GREATEST", "isinstance(value, int | float)",
        STRANGERS, "number_without_end_is_refused",
    ),
    Guarded(
        "number without end of a page that comes back", f"{LIVE}/page_socket.py", " and len(number) <= MOST_DIGITS", "",
        STRANGERS, "comes_back_with_a_number",
    ),
    Guarded(
        "too many pages", f"{LIVE}/server.py", "if len(self._sockets) >= PAGES_AT_ONCE:", "if False:",
        ATTACKS, "pages_and_connections",
    ),
    Guarded(
        "too many connections", f"{LIVE}/server.py", "limit_concurrency=CONNECTIONS_AT_ONCE,", "",
        ATTACKS, "pages_and_connections",
    ),
    Guarded(
        "many idle connections", f"{LIVE}/guard.py", "if len(waiting) > HALF_OPEN_AT_ONCE:", "if False:",
        STRANGERS, "idle_connections",
    ),
    Guarded(
        "connection that never asks", f"{LIVE}/guard.py", "call_later(ASKS_WITHIN_S,", "call_later(1e6,",
        STRANGERS, "never_asks",
    ),
    Guarded(
        "slow reader", f"{LIVE}/page_socket.py",
        "await asyncio.wait_for(self._acknowledged.wait(), ACKNOWLEDGED_WITHIN_S)", "await self._acknowledged.wait()",
        "test_never_held_up", "silent_is_let_go",
    ),
    Guarded(
        "viewer who writes", f"{LIVE}/page_socket.py",
        "        if self._is_viewer:\n            raise StateError(ONLY_LOOKS)\n", "", ATTACKS, "only_looks",
    ),
    Guarded(
        "viewer's token taken for the writer's", f"{LIVE}/guard.py", 'scope["role"] = roles[0]',
        'scope["role"] = WRITER', ATTACKS, "only_looks",
    ),
    Guarded("two who write", f"{LIVE}/pen.py", "if not self.may_write(page):", "if False:", ATTACKS, "one_page_writes"),
    Guarded(
        "--host beyond loopback without a password", f"{LIVE}/access.py",
        "if password_file is None and host not in LOOPBACK_NAMES:", "if False:", "test_live_command", "bad_input",
    ),
    Guarded(
        "short password", f"{LIVE}/access.py", "if len(words) < LEAST_LETTERS:", "if False:",
        "test_live_command", "bad_input",
    ),
    Guarded(
        "wrong password", f"{LIVE}/guard.py", "if self._password and not is_password(", "if False and not is_password(",
        GUARD, "password_is_stated",
    ),
    Guarded(
        "guesses of the password", f"{LIVE}/guard.py", "await asyncio.sleep(GUESS_COSTS_S)", "pass",
        GUARD, "guesses_of_the_password",
    ),
    Guarded(
        "guesses side by side", f"{LIVE}/guard.py", "async with self._guess:", "if True:",
        GUARD, "guesses_of_the_password",
    ),
    Guarded(
        "no warning of plain HTTP", f"{LIVE}/access.py", "return PLAIN if self.certificate is None else ENCRYPTED",
        'return ""', "test_live_command", "warns_of_plain_http",
    ),
    Guarded(
        "no TLS", f"{LIVE}/server.py", "ssl_certfile=way.certificate,\n                ssl_keyfile=way.key,\n", "\n",
        "test_tls", "encrypted",
    ),
    Guarded(
        "key that does not fit the certificate", f"{LIVE}/access.py", "        _check_pair(certificate, key)\n",
        "        pass\n", "test_tls", "pair",
    ),
    Guarded(
        "policy that lets inline script in", f"{LIVE}/guard.py", "script-src 'self';",
        "script-src 'self' 'unsafe-inline';", ATTACKS, "no_script_of_its_own",
    ),
    Guarded(
        "no policy", f"{LIVE}/guard.py", '    "Content-Security-Policy": POLICY,\n', "", STRANGERS, "every_answer",
    ),
    Guarded(
        "page within a foreign frame", f"{LIVE}/guard.py", '    "X-Frame-Options": "DENY",\n', "",
        STRANGERS, "every_answer",
    ),
    Guarded(
        "camera's password shown", "fingervision/frames/network_stream.py",
        'return SECRET_PARAMETERS.sub(r"\\1***", shown)', "return name", STRANGERS, "cameras_password",
    ),
    Guarded(
        "markup in a report's table", "fingervision/diagnosis/report/html_parts.py",
        "[escape(f.role), escape(f.name),", "[escape(f.role), f.name,",
        "diagnosis/test_report_files", "markup_in_the_names",
    ),
    Guarded(
        "markup in a comparison's table", "fingervision/diagnosis/report/comparison_files.py",
        "[escape(name), number(one.rms_mm)", "[name, number(one.rms_mm)",
        "diagnosis/test_report_files", "several_models",
    ),
    Guarded(
        "markup in a report's sentences", "fingervision/diagnosis/report/html_parts.py",
        'f"<li>{escape(item)}</li>"', 'f"<li>{item}</li>"', "diagnosis/test_report_files", "markup_in_a_sentence",
    ),
)  # fmt: skip
IN_A_BROWSER = (
    Guarded(
        "markup in a name, on the page", f"{LIVE}/page/bus.js", "at(id).textContent = words;",
        "at(id).innerHTML = words;", ATTACKS, "markup_in_a_name",
    ),
)  # fmt: skip


def pytest_passes(top: Path, tests: list[str]) -> bool:
    """Whether tests of a copy of the sources pass; none that is chosen is a fault."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-m", "slow or not slow", *tests]
    environment = {**os.environ, "PYTHONPATH": str(top)}
    try:
        done = subprocess.run(
            command, cwd=top, env=environment, capture_output=True, text=True, check=False, timeout=PATIENCE_S
        )
    except subprocess.TimeoutExpired:
        return False  # what is no longer refused is served for ever
    if done.returncode not in (0, 1) or ("passed" not in done.stdout and "failed" not in done.stdout):
        sys.exit(f"{' '.join(tests)} did not run:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return done.returncode == 0


@benchmark(only={"default": "", "help": "part of a guard's name"}, browser=False)
def main(chosen: Namespace) -> None:
    """Print the table."""
    guards = [each for each in GUARDS + IN_A_BROWSER * chosen.browser if chosen.only in each.name]
    unseen = 0
    with tempfile.TemporaryDirectory() as name:
        top = Path(name)
        for copied in COPIED:
            (shutil.copytree if (TOP / copied).is_dir() else shutil.copy2)(TOP / copied, top / copied)
        for chosen_tests in sorted({tuple(each.tests) for each in guards}):
            if not pytest_passes(top, list(chosen_tests)):
                sys.exit(f"{' '.join(chosen_tests)} fails on the sources as they are.")
        for each in guards:
            path = top / each.file
            text = path.read_text(encoding="utf-8")
            if text.count(each.stands) != 1:
                sys.exit(f"The guard against {each.name} no longer stands in {each.file} as it is written here.")
            path.write_text(text.replace(each.stands, each.instead), encoding="utf-8")
            is_seen = not pytest_passes(top, each.tests)
            path.write_text(text, encoding="utf-8")
            unseen += not is_seen
            print(f"{each.name:50} {each.test}: {each.words:32} {'fails' if is_seen else 'PASSES'}", flush=True)
    print(f"{len(guards)} guards, {unseen} that no test misses")
    sys.exit(bool(unseen))
