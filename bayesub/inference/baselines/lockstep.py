"""Searches that advance side by side, so that one batch of simulations answers all of them."""

import queue
from concurrent.futures import ThreadPoolExecutor

_ENDED, _ABANDONED = object(), object()


class Abandoned(Exception):
    """The batch that a search waits for has failed."""


def together(searches, answer, progress=None) -> list:
    """Run searches written for one start at a time so that their questions are answered in batches.

    Each search has a thread. It waits at its question until every other search has asked or ended; then one call of
    `answer` serves all of them. What a search does depends on its own questions and answers only, so if answers do not
    depend on what else is in the batch, the result is that of running one search after the other.

    Parameters
    ----------
    searches : functions ``search(ask) -> result``, where ``ask(question)`` returns an answer
    answer : function of a list of questions, in the order of the searches, that returns a list of answers
    progress : object with ``update(done, total, unit)``, called with the number of searches that have ended; or None

    Returns
    -------
    list of results in the order of the searches; an exception in a search is raised when the others have ended.
    """
    events = queue.SimpleQueue()
    replies = [queue.SimpleQueue() for _ in searches]

    def work(n):
        def ask(question):
            events.put((n, question))
            reply = replies[n].get()
            if reply is _ABANDONED:
                raise Abandoned
            return reply

        return searches[n](ask)

    with ThreadPoolExecutor(max(1, len(searches))) as pool:
        futures = [pool.submit(work, n) for n in range(len(searches))]
        for n, future in enumerate(futures):
            future.add_done_callback(lambda _, n=n: events.put((n, _ENDED)))
        n_live = len(searches)
        try:
            while n_live:
                arrived = sorted((events.get() for _ in range(n_live)), key=lambda event: event[0])
                waiting = [(n, question) for n, question in arrived if question is not _ENDED]
                if len(waiting) < n_live and progress is not None:
                    progress.update(len(searches) - len(waiting), len(searches), "starts")
                n_live = len(waiting)
                if waiting:
                    numbers, questions = zip(*waiting, strict=True)
                    for n, reply in zip(numbers, answer(list(questions)), strict=True):
                        replies[n].put(reply)
        finally:
            for reply in replies:
                reply.put(_ABANDONED)
    return [future.result() for future in futures]
