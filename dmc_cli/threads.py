"""Work in threads, as many as the system gives: with fewer it takes longer, without any the caller does it.

A pool of Python's own gives up where one thread of many cannot be started.
"""

from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future
from threading import Thread
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def each_in_threads(
    function: Callable[[Item], Result], items: Sequence[Item], threads: int, name: str = "dmc"
) -> Generator[Result, None, None]:
    """Yield what a function returns for each item, in the order of the items.

    The first error, in that order, is raised; what has not begun by then, or when the caller leaves, is left
    undone, and what has begun is waited for.

    Args:
        function: Is called by several threads at once.
        items: What to call it with.
        threads: Threads at most.
        name: Of the threads.
    """
    results: list[Future[Result]] = [Future() for _ in items]
    waiting = deque(zip(results, items, strict=True))
    started: list[Thread] = []
    try:
        for number in range(min(threads, len(items))):
            thread = Thread(target=_work, args=(function, waiting), name=f"{name}-{number}")
            try:
                thread.start()
            except RuntimeError:  # the system gives no more
                break
            started.append(thread)
        for result in results:
            if not started:
                _work_once(function, waiting)
            yield result.result()
    finally:
        waiting.clear()
        for thread in started:
            thread.join()


def _work(function: Callable[[Item], Result], waiting: deque[tuple[Future[Result], Item]]) -> None:
    """Call the function for one item after the other until none is left."""
    while _work_once(function, waiting):
        pass


def _work_once(function: Callable[[Item], Result], waiting: deque[tuple[Future[Result], Item]]) -> bool:
    """Call the function for the next item; return whether there was one."""
    try:
        result, item = waiting.popleft()
    except IndexError:
        return False
    try:
        result.set_result(function(item))
    except BaseException as error:
        result.set_exception(error)  # raised where the result is asked for
    return True
