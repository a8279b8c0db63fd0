"""Stages in threads: order, bounded room, errors and early ends; no thread stays."""

import threading
import time

import pytest

from sogjax.io.threads import Writer, prefetch


@pytest.fixture(autouse=True)
def no_thread_stays():
    before = set(threading.enumerate())
    yield
    assert set(threading.enumerate()) == before


def wait_for(condition):
    for _ in range(500):
        if condition():
            return
        time.sleep(0.01)
    raise AssertionError("it did not come about within five seconds")


def noted(count, made, closed):
    """The numbers up to `count`; each is noted when it is made, and the end of the generator too."""
    try:
        for k in range(count):
            made.append(k)
            yield k
    finally:
        closed.append(threading.current_thread())


def test_items_come_in_order_from_another_thread():
    made, closed = [], []
    assert list(prefetch(noted(50, made, closed), 3)) == list(range(50))
    assert closed[0] is not threading.current_thread()


def test_a_slow_taker_holds_the_maker_back():
    """With room for three, four are made beside the one that was taken: three wait and one has no room yet."""
    made, closed = [], []
    items = prefetch(noted(50, made, closed), 3)
    assert next(items) == 0
    wait_for(lambda: len(made) == 5)
    time.sleep(0.05)
    assert len(made) == 5
    items.close()
    assert len(closed) == 1


def test_an_error_of_the_maker_comes_after_the_items_before_it():
    def failing():
        yield 1
        yield 2
        raise KeyError("three")

    items = prefetch(failing(), 5)
    assert [next(items), next(items)] == [1, 2]
    with pytest.raises(KeyError, match="three"):
        next(items)


def test_everything_put_is_consumed_in_order():
    taken = []
    with Writer(taken.extend, 2) as behind:
        for k in range(50):
            behind.put(k)
    assert taken == list(range(50))


def test_a_slow_consumer_holds_the_putter_back():
    go, taken = threading.Event(), []

    def consume(items):
        for item in items:
            go.wait(5.0)
            taken.append(item)

    put = []
    with Writer(consume, 2) as behind:
        putter = threading.Thread(target=lambda: [(behind.put(k), put.append(k)) for k in range(20)])
        putter.start()
        wait_for(lambda: len(put) == 3)  # one in the consumer's hand, two waiting
        time.sleep(0.05)
        assert len(put) == 3
        go.set()
        putter.join()
    assert taken == list(range(20))


def test_an_error_of_the_consumer_is_raised_where_items_are_put():
    def consume(items):
        next(items)
        raise OSError("disk full")

    def put_for_ever():
        with Writer(consume, 2) as behind:
            while True:
                behind.put(0)

    with pytest.raises(OSError, match="disk full"):
        put_for_ever()
    with pytest.raises(OSError, match="disk full"), Writer(consume, 2) as behind:
        behind.put(0)


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_what_was_put_before_an_error_is_still_consumed(error):
    taken = []

    def put_and_fail():
        with Writer(taken.extend, 4) as behind:
            for k in range(4):
                behind.put(k)
            raise error

    with pytest.raises(error):
        put_and_fail()
    assert taken == [0, 1, 2, 3]
