"""Workers: where the tasks of a build run, in this process, in others, or on a dask cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_all_start_methods, get_context, parent_process
from threading import Thread
from typing import Any, Protocol

from tourgen.errors import InputError, MissingTool
from tourgen.threads import cores, limit_native_threads

_ANSWER_S = 10
# Libraries that start threads do not survive a fork, but for one before they have started any.
_START = "forkserver" if "forkserver" in get_all_start_methods() else "spawn"
_STAGES = "tourgen.pipeline"


class Workers(Protocol):
    """Run functions elsewhere.

    Attributes:
        most: Functions that run at once.
        threads: That all of them may use together.
        widest: That one of them may use.
        are_here: Whether they share the memory of this machine.
    """

    most: int
    threads: int
    widest: int
    are_here: bool

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Begin to run a function."""

    def died(self, error: BaseException, /) -> bool:
        """Whether a function failed since its process died; a new one takes its place."""


class Here:
    """This process, one function after the other."""

    most = 1
    are_here = True

    def __init__(self) -> None:
        self.threads = self.widest = cores()

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Run a function to its end."""
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future

    def died(self, _: BaseException, /) -> bool:
        """Never: it would be this one."""
        return False


class Processes:
    """Processes of this machine, started when first needed."""

    are_here = True

    def __init__(self, most: int) -> None:
        self.most = most
        self.threads = self.widest = max(cores(), most)
        self._pool = self._started()

    def _started(self) -> ProcessPoolExecutor:
        context = get_context(_START)
        return ProcessPoolExecutor(self.most, context, _die_with_parent)

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Run a function in a process that is free."""
        try:
            return self._pool.submit(function, *arguments)
        except (BrokenProcessPool, OSError):  # the latter where it is just breaking
            self._renew()
            return self._pool.submit(function, *arguments)

    def died(self, error: BaseException, /) -> bool:
        """A process that dies takes all others of its pool along."""
        if not isinstance(error, BrokenProcessPool):
            return False
        self._renew()
        return True

    def _renew(self) -> None:
        self._pool.shutdown(wait=False)
        self._pool = self._started()

    def stop(self) -> None:
        """End the processes."""
        self._pool.shutdown(cancel_futures=True)


class Cluster:
    """Workers of a dask cluster that see the tour's folder where this process sees it."""

    widest = 1
    are_here = False

    def __init__(self, address: str) -> None:
        """Connect.

        Raises:
            MissingTool: The library for it is not installed.
            InputError: No scheduler answers at the address, or it has no workers, or such as run
                several tasks in one process, for which not every library is made.
        """
        try:
            from distributed import Client
        except ImportError:
            raise MissingTool(
                "--cluster: expected dask.distributed, found none",
                'python3 -m pip install "tourgen[cluster]"',
            ) from None
        try:
            self._client = Client(address, timeout=_ANSWER_S, set_as_default=False)
        except (OSError, ValueError, TimeoutError):
            raise InputError(
                f"--cluster: expected a scheduler that answers at `{address}`, found none",
                "start `dask scheduler` and `dask worker`, and give the address that it tells",
            ) from None
        about = self._client.scheduler_info(n_workers=-1)["workers"].values()
        self.most = self.threads = len(about)
        most_threads = max((each["nthreads"] for each in about), default=0)
        if most_threads != 1:
            self.stop()
            found = f"one of {most_threads}" if most_threads else "none"
            raise InputError(
                f"--cluster: expected workers of one thread at `{address}`, found {found}",
                f"start `dask worker --nthreads 1 {address}` on each machine that shares the "
                "tour's folder, as often as it has cores",
            )
        self._executor = self._client.get_executor(pure=False)

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Run a function on a worker that is free."""
        future: Future[Any] = self._executor.submit(function, *arguments)
        return future

    def died(self, error: BaseException, /) -> bool:
        """Dask gives a task to other workers by itself, some times."""
        from distributed import KilledWorker

        return isinstance(error, KilledWorker)

    def stop(self) -> None:
        """Leave the cluster, which goes on."""
        self._client.close()


def load_ahead() -> None:
    """Let another process load what workers need, while this one reads on: they are its forks.

    It takes each worker, and this process, two seconds; forked, they share the memory, too. To be
    called after ``limit_native_threads``: the fork server may start no threads.
    """
    if _START == "forkserver":
        from multiprocessing import forkserver

        forkserver.set_forkserver_preload([_STAGES])
        forkserver.ensure_running()


@contextmanager
def workers(jobs: int, cluster: str | None = None) -> Iterator[Workers]:
    """Workers, for as long as the block lasts: those of a cluster, or so many of this machine."""
    limit_native_threads()
    if cluster:
        there = Cluster(cluster)
        try:
            yield there
        finally:
            there.stop()
        return
    if jobs == 1:
        yield Here()
        return
    processes = Processes(jobs)
    try:
        yield processes
    finally:
        processes.stop()


def _die_with_parent() -> None:
    """A build that was killed leaves no process behind that works on for nobody."""

    def wait() -> None:
        parent = parent_process()
        if parent is not None:
            parent.join()
            os._exit(1)

    Thread(target=wait, daemon=True).start()
