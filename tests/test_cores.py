"""What is done on all cores: results in order, errors told, and nobody goes on in vain."""

import time
from concurrent.futures import CancelledError
from threading import Event, get_ident

import pytest

from sogjax.model import cores
from sogjax.model.cores import go_on, in_threads


@pytest.fixture(params=[1, 2, 4])
def number(request, monkeypatch):
    monkeypatch.setattr(cores, "usable_cores", lambda: request.param)
    return request.param


@pytest.mark.parametrize("count", [0, 1, 7])
def test_results_come_in_the_order_of_the_items(number, count):
    def later_first(k):
        time.sleep(0.002 * (count - k))
        return k * k

    assert in_threads(later_first, range(count)) == [k * k for k in range(count)]


def test_what_is_made_is_watched_in_order_as_it_comes(number):
    def watched(results):
        for result in results:
            seen.append((result, made.count(2)))
            yield result

    made, seen = [], []
    assert in_threads(lambda k: made.append(k) or k, range(3), 1, watched) == [0, 1, 2]
    assert seen == [(0, 0), (1, 0), (2, 1)]
    seen.clear()
    assert in_threads(lambda k: k, range(3), watched=watched) == [0, 1, 2]
    assert [result for result, _ in seen] == [0, 1, 2]


def test_threads_within_a_thread_take_items_in_order(number):
    inner = lambda k: in_threads(lambda j: (k, j, hasattr(cores._here, "left")), range(3))
    assert in_threads(inner, range(2)) == [[(k, j, number > 1) for j in range(3)] for k in range(2)]
    assert not hasattr(cores._here, "left")


def test_no_more_threads_than_asked_for(monkeypatch):
    monkeypatch.setattr(cores, "usable_cores", lambda: 4)
    assert in_threads(lambda k: hasattr(cores._here, "left"), range(3), 1) == [False] * 3


def test_an_error_is_raised_and_ends_what_goes_on_beside_it(monkeypatch):
    monkeypatch.setattr(cores, "usable_cores", lambda: 2)
    begun, ended = Event(), []

    def work(k):
        if k == 0:
            begun.wait(10.0)
            raise ValueError("the first one fails")
        begun.set()
        try:
            for _ in range(1000):
                go_on()
                time.sleep(0.01)
        except CancelledError:
            ended.append(k)
            raise

    with pytest.raises(ValueError, match="the first one fails"):
        in_threads(work, range(2))
    assert ended == [1]
    go_on()  # here nobody has left


def test_what_goes_on_within_a_thread_ends_when_the_outer_caller_leaves(monkeypatch):
    monkeypatch.setattr(cores, "usable_cores", lambda: 2)
    begun, done = Event(), []

    def inner(k):
        done.append(k)
        begun.set()
        time.sleep(0.01)

    def outer(k):
        if k == 0:
            begun.wait(10.0)
            raise ValueError("the first one fails")
        in_threads(inner, range(1000))

    with pytest.raises(ValueError, match="the first one fails"):
        in_threads(outer, range(2))
    assert len(done) < 900


def test_nothing_more_is_begun_when_whoever_watches_leaves(monkeypatch):
    monkeypatch.setattr(cores, "usable_cores", lambda: 2)
    done = []

    def watched(results):
        for _ in results:
            raise KeyboardInterrupt
        yield from results

    with pytest.raises(KeyboardInterrupt):
        in_threads(lambda k: done.append(k) or time.sleep(0.01), range(1000), watched=watched)
    assert len(done) < 900


@pytest.mark.parametrize(("number", "within"), [(2, 1), (4, 2), (5, 2)])
def test_threads_share_the_cores_with_those_within_them(monkeypatch, number, within):
    monkeypatch.setattr(cores, "usable_cores", lambda: number)
    assert in_threads(lambda k: cores._here.cores, range(2)) == [within] * 2
    deep = in_threads(lambda k: len({*in_threads(lambda j: (time.sleep(0.05), get_ident())[1], range(2))}), range(2))
    assert deep == [within] * 2
