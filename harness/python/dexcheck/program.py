"""The program dexcheck, as the rest of the package calls it."""

import os
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

from .controller import InputError, RunError, serve

_PASS, _DISAGREEMENT, _INPUT = 0, 1, 2


def _find_program():
    """The environment's DEXCHECK, the program of this build or installation, or the one on the path."""
    folder = Path(__file__).resolve().parent
    above = [folder.parents[depth] for depth in (1, 3) if depth < len(folder.parents)]
    near = [folder / "_program/bin/dexcheck", *(one / "bin/dexcheck" for one in above)]
    found = os.environ.get("DEXCHECK") or next((str(one) for one in near if one.is_file()), None)
    return found or shutil.which("dexcheck") or "dexcheck"


class _Server:
    """Serves a law of this process to a program: one run after the other here, or each in a process of its own."""

    def __init__(self, law, apart, folder):
        self.law, self.apart, self.error, self.children = law, apart, None, []
        self.path = os.path.join(folder, "controller")
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(self.path)
        self.listener.listen(64)

    def accept(self):
        connection, _ = self.listener.accept()
        with connection:
            if not self.apart:
                self.error = serve(connection, self.law) or self.error
                return
            child = os.fork()
            if child == 0:
                try:
                    self.listener.close()
                    serve(connection, self.law)
                finally:
                    os._exit(0)
            self.children.append(child)
        self.children = [child for child in self.children if os.waitpid(child, os.WNOHANG)[0] == 0]

    def close(self):
        self.listener.close()
        for child in self.children:
            os.waitpid(child, 0)


def as_path(path):
    """A path as a word of a command line, which no option looks like."""
    text = os.fspath(path)
    return "./" + text if text.startswith("-") else text


def execute(words, controller=None, apart=False):
    """Runs the program. Returns its exit code, what it printed, and the exception of a law that runs here."""
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        server = None
        if isinstance(controller, (str, os.PathLike)):
            words = [*words, "--controller", os.fspath(controller)]
        elif controller is not None:
            server = _Server(controller, apart, folder)
            words = [*words, "--controller", "unix:" + server.path]
        program = _find_program()
        try:
            process = subprocess.Popen([program, *map(str, words)], stdin=subprocess.DEVNULL, stdout=out, stderr=err,
                                       env={"DEXCHECK_PYTHON": sys.executable, **os.environ})
        except OSError as error:
            raise RunError(f"{program}: cannot be run: {error.strerror}") from error
        try:
            if server is not None:
                _serve_until_end(process, server)
            code = process.wait()
        except BaseException:
            process.send_signal(signal.SIGINT)
            process.wait()
            raise
        finally:
            if server is not None:
                server.close()
        out.seek(0)
        err.seek(0)
        printed = out.read().decode(errors="replace")
        line = (err.read().decode(errors="replace").strip().splitlines() or [""])[-1]
        line = line or (f"{program}: ended by signal {-code}" if code < 0 else f"{program}: exit code {code}, without a word")
        line = line.replace("unix:" + server.path, "of this process") if server else line
        if code == _INPUT:
            raise InputError(line) from (server.error if server else None)
        if code not in (_PASS, _DISAGREEMENT):
            raise RunError(line) from (server.error if server else None)
        return code, printed


def _serve_until_end(process, server):
    ended = os.pidfd_open(process.pid)
    try:
        while True:
            ready, _, _ = select.select([server.listener, ended], [], [])
            if server.listener in ready:
                server.accept()
            elif ended in ready:
                return
    finally:
        os.close(ended)
