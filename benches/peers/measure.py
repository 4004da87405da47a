"""Run a program as a child process and measure its cost."""

import os
import signal
import subprocess
import sys
import threading
from dataclasses import dataclass

# One core each: spinning helper threads of a linear-algebra library would count as CPU seconds.
THREAD_VARIABLES = (
    "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "NUMBA_NUM_THREADS",
)


class PeersError(Exception):
    """The comparison cannot continue; the message states the reason and the remedy."""


@dataclass(frozen=True)
class Usage:
    """Cost of one child process."""

    cpu: float  # user and system seconds
    peak_mb: float  # largest resident memory
    status: int  # exit status


def run(command, folder, accepted=(0,), interrupt_after=None):
    """Usage of `command`, run in `folder`, where its output is kept in `output.log`.

    `interrupt_after` seconds it is sent the signal of Ctrl-C. Raises `PeersError` if it cannot be started or ends with
    a status not in `accepted`.

    The kernel counts the peak from before the child's image replaced this process's: nothing smaller than this
    process (some 25 MB) can be seen.
    """
    log = os.path.join(folder, "output.log")
    with open(log, "wb") as output:
        try:
            child = subprocess.Popen(
                [str(part) for part in command], cwd=folder, env=environment(),
                stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
            )
        except OSError as error:
            raise PeersError(f"{command[0]} cannot be started: {error}") from error
        usage = wait(child, interrupt_after)
    if usage.status not in accepted:
        words = " ".join(map(str, command))
        raise PeersError(f"{words}\nended with status {usage.status}; its last words:\n{tail(log)}")
    return usage


def wait(child, interrupt_after):
    """Usage of a child once it has ended."""
    timer = None
    if interrupt_after is not None:
        timer = threading.Timer(interrupt_after, os.kill, (child.pid, signal.SIGINT))
        timer.start()
    try:
        _, status, spent = os.wait4(child.pid, 0)
    except BaseException:
        child.kill()
        child.wait()
        raise
    finally:
        if timer is not None:
            timer.cancel()
    child.returncode = os.waitstatus_to_exitcode(status)
    return Usage(spent.ru_utime + spent.ru_stime, peak_mb(spent), child.returncode)


def peak_mb(spent):
    """Largest resident memory in megabytes: macOS counts bytes, other systems kibibytes."""
    return spent.ru_maxrss * (1e-6 if sys.platform == "darwin" else 1024e-6)


def environment():
    """The surroundings of every child: this process's, one thread, no compiled files left beside the scripts."""
    return {**os.environ, **dict.fromkeys(THREAD_VARIABLES, "1"), "PYTHONDONTWRITEBYTECODE": "1"}


def tail(path, lines=15):
    """The last lines of a text file."""
    with open(path, encoding="utf-8", errors="replace") as file:
        return "".join(file.readlines()[-lines:]).rstrip()
