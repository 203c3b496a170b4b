"""Tasks on executors that may break: each ends once, with a result or an error."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from dataclasses import dataclass
from pickle import PicklingError
from queue import Empty, SimpleQueue
from typing import Any

from ._executors import PULSE, Executors, close, unguarded, unreachable, workers_of

#: Errors of input, which the same task would raise again. ``obsdeg.ProblemError`` is a ValueError.
INPUT = (ValueError, TypeError, PicklingError)
#: Returned by `draw` when there is no task.
END: Any = object()
#: Seconds after which a cluster that answers no check is given up.
PATIENCE = 30.0
#: Number of consecutive executors that may refuse all tasks.
REFUSED = 3
#: Seconds between two counts of the workers.
COUNTED = 10.0


class CampaignError(RuntimeError):
    """Error of a campaign.

    Attributes:
        task: the task that failed too often; None if no executor was available.
        pending: other drawn tasks that are not finished.
    """

    def __init__(self, text: str, task: Any = None, pending: list[Any] | None = None) -> None:
        super().__init__(text)
        self.task, self.pending = task, pending or []


@dataclass
class Ended:
    """A finished task: `result`, or the last `error` after `tries` failures."""

    task: Any
    result: Any = None
    error: BaseException | None = None
    tries: int = 1


@dataclass
class _Tried:
    """An unfinished task: number of its failures, and number of executors that broke while they had it."""

    task: Any
    tries: int = 0
    losses: int = 0


def _is_lost(future: Future[Any]) -> bool:
    """True if the executor of a finished future broke."""
    return future.cancelled() or isinstance(future.exception(), (BrokenExecutor, CancelledError))


class Work:
    """Tasks on their way through executors.

    A task is in exactly one place: not drawn, `pending`, `waiting` (handed out), `suspects`, or ended. A pool
    that breaks does not tell which of its tasks broke it. Its tasks are tried again, and after `retries`
    losses one at a time, so that the reported task is the one that broke the executor.

    Args:
        function: called with each task.
        draw: returns the next task, or :data:`END`; called again after each finished task.
        executor: makes the executor, and another if one broke.
        retries: number of times that a task is tried again.
        ahead: largest number of tasks handed out; None for twice the number of workers, at least 8.
        divide: returns the parts of a task that failed too often, which are tried instead; empty if it
            cannot be divided.
    """

    def __init__(
        self,
        function: Callable[[Any], Any],
        draw: Callable[[], Any],
        executor: Executors,
        retries: int,
        ahead: int | None,
        divide: Callable[[Any], list[Any]] = lambda task: [],
    ) -> None:
        self.function, self.draw, self.executor = function, draw, executor
        self.retries, self.ahead, self.divide = retries, ahead, divide
        self.pending: deque[_Tried] = deque()
        self.suspects: deque[_Tried] = deque()
        self.waiting: dict[Future[Any], _Tried] = {}
        # a wait for all futures would need time for each of them whenever one ends
        self._ended: SimpleQueue[Future[Any]] = SimpleQueue()
        self._counted = (-COUNTED, 0)

    @property
    def workers(self) -> int:
        """Number of workers at the last count."""
        return self._counted[1]

    def open(self) -> list[Any]:
        """Drawn tasks that have not ended."""
        return [t.task for t in (*self.waiting.values(), *self.pending, *self.suspects)]

    def ended(self) -> Iterator[Ended]:
        """Yields every drawn task once, in the order of their ends.

        Raises:
            CampaignError: no executor is available, or the cluster does not answer.
        """
        pool = self.executor()
        fruitless = 0
        try:
            while True:
                broken: BaseException | None = None
                for refused in self._hand_out(pool):
                    if isinstance(refused, Ended):
                        yield refused
                    else:
                        broken = refused
                if not self.waiting and broken is None:
                    return
                heard = self._heard(pool) if broken is None else []
                if broken is not None or any(map(_is_lost, heard)):
                    # results are read before the rest counts as lost
                    heard = [f for f in self.waiting if f.done()]
                for future in heard:
                    end = self._taken(future)
                    if isinstance(end, Ended):
                        yield end
                    elif end is not None:
                        broken = end
                if broken is not None:
                    # tasks in a broken executor count as losses, which are limited; an executor that takes no
                    # task counts here
                    fruitless = 0 if self.waiting else fruitless + 1
                    if (why := unguarded(pool)) is not None:
                        raise self._without_workers(why)
                    why = unreachable(pool)
                    if why is not None or fruitless > REFUSED:
                        raise self._without_workers(why or str(broken) or type(broken).__name__) from broken
                    yield from self._lose(broken)
                    close(pool, at_once=True)
                    # the service that starts workers may be restarting
                    time.sleep(fruitless / 4)
                    pool = self._another(broken)
                    self._counted = (-COUNTED, 0)
        finally:
            close(pool, at_once=bool(self.waiting))

    def _hand_out(self, pool: Executor) -> Iterator[Ended | BaseException]:
        """Fills the executor. Yields tasks that it refuses as input, and the error of an executor that takes
        none."""
        room = 1 if self._alone() else self._room(pool)
        while len(self.waiting) < room:
            if not self.pending and (drawn := self.draw()) is not END:
                self.pending.append(_Tried(drawn))
            if not self.pending and self.suspects and not self.waiting:
                self.pending.append(self.suspects.popleft())
                room = 1
            if not self.pending:
                return
            first = self.pending[0]
            try:
                future = pool.submit(self.function, first.task)
            except INPUT as e:
                self.pending.popleft()
                yield Ended(first.task, error=e, tries=first.tries + 1)
            except Exception as e:
                yield e
                return
            else:
                self.waiting[future] = self.pending.popleft()
                future.add_done_callback(self._ended.put)

    def _alone(self) -> bool:
        """True if a suspect is the only task handed out."""
        return len(self.waiting) == 1 and next(iter(self.waiting.values())).losses > self.retries

    def _room(self, pool: Executor) -> int:
        if self.ahead is not None:
            return self.ahead
        when, workers = self._counted
        if time.monotonic() - when >= COUNTED:
            workers = workers_of(pool)
            self._counted = (time.monotonic(), workers)
        return max(8, 2 * workers)

    def _heard(self, pool: Executor) -> list[Future[Any]]:
        """Waits until a task ends. Returns the futures that ended.

        Raises:
            CampaignError: the cluster does not answer.
        """
        silent_since: float | None = None
        while True:
            news = self._news()
            heard = [f for f in news if f in self.waiting]
            if heard:
                return heard
            if news:
                # futures of an executor that broke
                continue
            began = time.monotonic()
            why = unreachable(pool)
            if why is None:
                silent_since = None
                continue
            silent_since = began if silent_since is None else silent_since
            if time.monotonic() - silent_since >= PATIENCE:
                raise self._without_workers(why)

    def _news(self) -> list[Future[Any]]:
        """Futures that ended since the last call; waits at most :data:`PULSE` seconds for the first."""
        news = []
        try:
            news.append(self._ended.get(timeout=PULSE))
            while True:
                news.append(self._ended.get_nowait())
        except Empty:
            return news

    def _taken(self, future: Future[Any]) -> Ended | BaseException | None:
        """Outcome of a finished future: end of its task, error of a broken executor, or None if the task is
        tried again."""
        tried = self.waiting[future]
        try:
            error = future.exception()
        except CancelledError as e:
            error = e
        if error is None:
            del self.waiting[future]
            return Ended(tried.task, future.result())
        if _is_lost(future):
            # the task stays in `waiting`, since the other futures are read first
            return error
        del self.waiting[future]
        tried.tries += 1
        if isinstance(error, INPUT):
            return Ended(tried.task, error=error, tries=tried.tries)
        if tried.tries > self.retries:
            return self._given_up(tried, error)
        self.pending.append(tried)
        return None

    def _lose(self, broken: BaseException) -> list[Ended]:
        """Takes back the tasks of a broken executor. Returns the ends of tasks that broke one alone too
        often."""
        alone = self._alone()
        lost = list(self.waiting.values())
        self.waiting.clear()
        if alone:
            lost[0].tries += 1
            if lost[0].tries > self.retries or self.divide(lost[0].task):
                end = self._given_up(lost[0], broken)
                return [end] if end is not None else []
        for tried in lost:
            tried.losses += 1
        self.suspects.extend(t for t in lost if t.losses > self.retries)
        self.pending.extendleft(reversed([t for t in lost if t.losses <= self.retries]))
        return []

    def _given_up(self, tried: _Tried, error: BaseException) -> Ended | None:
        """End of a task that failed too often, or None if its parts are tried."""
        parts = self.divide(tried.task)
        self.suspects.extend(_Tried(part, losses=self.retries + 1) for part in parts)
        return None if parts else Ended(tried.task, error=error, tries=tried.tries)

    def _another(self, broken: BaseException) -> Executor:
        try:
            return self.executor()
        except Exception as e:
            raise self._without_workers(f"no other executor: {e}") from broken

    def _without_workers(self, why: str) -> CampaignError:
        pending = self.open()
        text = f"{why}: {len(pending)} tasks that were handed out are not done, nor those after them"
        return CampaignError(text, pending=pending)
