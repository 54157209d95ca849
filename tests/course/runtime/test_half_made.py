"""A node whose constructor raised is left as rclpy leaves it, and the next run replaces it."""

from __future__ import annotations

import gc
import threading
from collections.abc import Iterator

import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String

from course import Session
from course.runtime.context.context import as_default_context


class Driver(Node):
    """Takes a publisher and a thread, and finds no camera; its cleanup would give both back."""

    destroyed = 0

    def __init__(self, device: str = "broken", *, tidy: bool = False) -> None:
        super().__init__("driver")
        self.images = self.create_publisher(String, "image", 1)
        self.end = threading.Event()
        _ENDS.append(self.end)
        self.worker = threading.Thread(target=self.end.wait, name="camera worker")
        self.worker.start()
        if device == "broken":
            if tidy:
                self.destroy_node()
            raise OSError("no camera")

    def destroy_node(self) -> None:
        type(self).destroyed += 1
        self.end.set()
        self.worker.join()
        super().destroy_node()


_ENDS: list[threading.Event] = []


@pytest.fixture(autouse=True)
def _ended() -> Iterator[None]:
    Driver.destroyed = 0
    yield
    for end in _ENDS:
        end.set()
    _ENDS.clear()


def names(witness: Node) -> list[str]:
    return sorted(name for name in witness.get_node_names() if not name.startswith("_"))


@pytest.mark.parametrize("by", ["rclpy", "a session"])
def test_a_session_leaves_what_rclpy_leaves(session: Session, by: str) -> None:
    witness = session.run(Node, "witness")
    session.participate()
    with as_default_context(session.context), pytest.raises(OSError, match="camera") as caught:
        _ = Driver() if by == "rclpy" else session.run(Driver)
    gc.collect()
    assert caught.tb is not None  # as a notebook keeps it, and the node with it
    session.until(lambda: names(witness) == ["driver", "witness"])
    session.until(lambda: witness.count_publishers("image") == 1)
    assert sum(thread.name == "camera worker" for thread in threading.enumerate()) == 1
    assert Driver.destroyed == 0
    assert session.notices == []
    session.close()


def test_what_nobody_keeps_is_collected(session: Session) -> None:
    witness = session.run(Node, "witness")

    class Half(Node):
        def __init__(self) -> None:
            super().__init__("half")
            raise ValueError("half")

    with pytest.raises(ValueError, match="half"):
        session.run(Half)
    gc.collect()
    session.until(lambda: names(witness) == ["witness"], timeout=20)
    assert session.half_made() == []


def test_the_next_run_replaces_it_and_says_what_is_left(session: Session) -> None:
    witness = session.run(Node, "witness")
    kept = []
    for _ in range(2):
        with pytest.raises(OSError, match="no camera") as caught:
            session.run(Driver)
        kept.append(caught)
        session.until(lambda: names(witness) == ["driver", "witness"])
    assert len(session.notices) == 1  # the second time
    (before,) = session.half_made()

    node = session.run(Driver, "front")

    session.until(lambda: names(witness) == ["driver", "witness"])
    session.until(lambda: witness.count_publishers("image") == 1)
    assert session.nodes["/driver"] is node
    assert before.node is None
    assert session.half_made() == []
    assert Driver.destroyed == 0
    assert session.notices[-1] == (
        "The constructor of /driver raised OSError: no camera. It left the node on the graph and "
        "a thread (camera worker) behind. Nobody calls destroy_node() of a node that was never "
        "made, so a constructor gives back what it has made before it raises. The session has now "
        "taken that node off the graph; in a program it stays. A thread that does not end by "
        "itself ends with the kernel or program."
    )


def test_a_class_that_is_mended_in_its_cell_replaces_it(session: Session) -> None:
    witness = session.run(Node, "witness")

    def cell(*, broken: bool) -> None:
        class Camera(Node):
            def __init__(self) -> None:
                super().__init__("camera")
                self.create_publisher(String, "image", 1)
                if broken:
                    raise KeyError("rate")

        session.run(Camera)

    with pytest.raises(KeyError) as caught:
        cell(broken=True)
    cell(broken=False)
    assert caught.tb is not None
    session.until(lambda: names(witness) == ["camera", "witness"])
    session.until(lambda: witness.count_publishers("image") == 1)
    assert "It left the node on the graph behind." in session.notices[-1]


def test_a_constructor_that_gives_everything_back_is_no_news(session: Session) -> None:
    for _ in range(2):
        with pytest.raises(OSError, match="no camera"):
            session.run(Driver, tidy=True)
    assert session.half_made() == []
    assert session.notices == []
    assert Driver.destroyed == 2


def test_one_that_spins_itself_is_replaced_too(session: Session) -> None:
    witness = session.run(Node, "witness")
    executor = SingleThreadedExecutor(context=session.context)

    class Spinner(Node):
        def __init__(self) -> None:
            super().__init__("spinner")
            executor.add_node(self)
            raise ValueError("too late")

    kept = []
    for _ in range(2):
        with pytest.raises(ValueError, match="too late") as caught:
            session.run(Spinner)
        kept.append(caught)
        session.until(lambda: names(witness) == ["spinner", "witness"])
    session.stop(Spinner)
    session.until(lambda: names(witness) == ["witness"])
    executor.shutdown()


@pytest.mark.parametrize("what", ["everything", "driver", Driver])
def test_it_can_be_stopped_like_a_node(session: Session, what: object) -> None:
    witness = session.run(Node, "witness")
    with pytest.raises(OSError, match="no camera") as caught:
        session.run(Driver)
    session.stop(*([] if what == "everything" else [what]))
    assert caught.tb is not None
    if what == "everything":
        witness = session.run(Node, "witness")
    session.until(lambda: names(witness) == ["witness"])
    assert Driver.destroyed == 0
    assert session.notices == []


def test_it_goes_with_the_session() -> None:
    with Session() as outside:
        witness = outside.run(Node, "witness")
        session = Session(domain_id=outside.domain_id)
        with pytest.raises(OSError, match="no camera") as caught:
            session.run(Driver)
        outside.until(lambda: names(witness) == ["driver", "witness"])
        assert session.close().leaked == []
        assert caught.tb is not None
        outside.until(lambda: names(witness) == ["witness"])
        assert Driver.destroyed == 0
