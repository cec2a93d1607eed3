"""One thread draws all pictures of a process, and frees what forgotten pictures held.

An OpenGL context belongs to a thread, and a picture may be forgotten anywhere: in any thread, in
the middle of another picture, inside a lock. So whoever forgets one only leaves a note; the queue
of notes (`queue.SimpleQueue`) may be written to from destructors, and nobody waits for an answer.
"""

from __future__ import annotations

import atexit
import os
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

_Task = tuple[Callable[..., Any], tuple[Any, ...], "SimpleQueue[tuple[Any, Any]] | None"]

_MOST_SECONDS_AT_EXIT = 5.0


class DrawingThread:
    """A thread that does what it is asked, one thing after the other."""

    def __init__(self) -> None:
        self.process = os.getpid()
        self._tasks: SimpleQueue[_Task | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._work, name="clarke_gym-opengl", daemon=True)
        self._thread.start()

    def ask(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Call a function in the thread and return its result, or raise its error."""
        answer: SimpleQueue[tuple[Any, Any]] = SimpleQueue()
        self._tasks.put((function, arguments, answer))
        result, error = answer.get()
        if error is not None:
            raise error
        return result

    def tell(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Let the thread call a function some time, without waiting; safe in destructors."""
        self._tasks.put((function, arguments, None))

    def _work(self) -> None:
        self._do(self._tasks.get())  # loads a backend, which has itself closed at exit
        atexit.register(self._stop)  # as the later one this comes before that
        while self._do(self._tasks.get()):
            pass

    @staticmethod
    def _do(task: _Task | None) -> bool:
        # A function of its own, so that nothing of a task lives on until the next one comes.
        if task is None:
            return False
        function, arguments, answer = task
        result = error = None
        try:
            result = function(*arguments)
        except BaseException as problem:  # belongs to whoever asked
            error = problem
        if answer is not None:
            answer.put((result, error))
        return True

    def _stop(self) -> None:
        if self.process == os.getpid():
            self._tasks.put(None)
            self._thread.join(_MOST_SECONDS_AT_EXIT)


_threads: dict[int, DrawingThread] = {}
_making = threading.Lock()


def drawing_thread() -> DrawingThread:
    """Return the thread of this process; a forked one does not inherit its parent's.

    Returns
    -------
    DrawingThread

    Examples
    --------
    >>> drawing_thread() is drawing_thread()
    True
    """
    with _making:
        process = os.getpid()
        if process not in _threads:
            _threads.clear()
            _threads[process] = DrawingThread()
        return _threads[process]
