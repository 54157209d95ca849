"""Session: running, replacing, stopping and pausing nodes; what callbacks raise; closing."""

from __future__ import annotations

import re
import threading

import pytest
from rclpy.action import ActionServer
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci

import course
from course.errors import DomainError, SessionError, WaitTimeout


class Talker(Node):
    """Counts and says so, 200 times a second."""

    def __init__(self, name="talker"):
        super().__init__(name)
        self.count = 0
        self.publisher = self.create_publisher(String, "chatter", 10)
        self.timer = self.create_timer(0.005, self.say)

    def say(self):
        self.count += 1
        self.publisher.publish(String(data=str(self.count)))


class Listener(Node):
    """Keeps what it hears."""

    def __init__(self):
        super().__init__("listener")
        self.heard = []
        self.create_subscription(String, "chatter", self.hear, 10)

    def hear(self, message):
        self.heard.append(message.data)


def names_seen_from_outside(session):
    """Return the node names that another participant on the session's domain sees."""
    with course.Session(domain_id=session.domain_id) as outside:
        watcher = outside.run(Node, "watcher")
        return outside.until(
            lambda: [name for name in watcher.get_node_names() if not name.startswith("_")],
            what="the graph",
        )


def test_a_node_class_as_in_a_textbook_runs_in_the_background(any_session):
    talker, listener = any_session.run(Talker), any_session.run(Listener)
    any_session.until(lambda: len(listener.heard) >= 5, what="five messages")
    assert any_session.nodes == {"/talker": talker, "/listener": listener}
    assert any_session.errors == []


def test_running_again_replaces_the_node(any_session):
    first = any_session.run(Talker)
    any_session.until(lambda: first.count)
    second = any_session.run(Talker)
    assert list(any_session.nodes.values()) == [second]
    listener = any_session.run(Listener)
    any_session.until(lambda: len(listener.heard) >= 3)
    assert second.count_publishers("chatter") == 1


def test_a_class_defined_again_with_another_node_name_replaces_the_old_one(session):
    def define(name):
        class Camera(Node):
            def __init__(self):
                super().__init__(name)

        return Camera

    session.run(define("camera"))
    session.run(define("front_camera"))
    assert list(session.nodes) == ["/front_camera"]


def test_other_arguments_make_another_node(session):
    session.run(Talker, "left")
    session.run(Talker, name="right")
    assert sorted(session.nodes) == ["/left", "/right"]


def test_the_same_name_replaces_whatever_made_it(session):
    session.run(Talker)
    other = session.run(Node, "talker")
    assert session.nodes == {"/talker": other}


def test_lambdas_are_not_confused_with_each_other(session):
    session.run(lambda: Node("one"))
    session.run(lambda: Node("two"))
    assert sorted(session.nodes) == ["/one", "/two"]


def test_a_node_made_in_the_sessions_context_can_be_run_as_it_is(session):
    node = Node("ready_made", context=session.context)
    assert session.run(node) is node
    assert session.nodes == {"/ready_made": node}


@pytest.mark.parametrize("how", ["node", "class", "name", "full name", "everything"])
def test_stop_takes_a_node_off_the_graph(session, how):
    talker = session.run(Talker)
    what = {"node": [talker], "class": [Talker], "name": ["talker"], "full name": ["/talker"]}
    session.stop(*what.get(how, []))
    assert session.nodes == {}
    assert names_seen_from_outside(session) == ["watcher"]
    session.stop(*what.get(how, []))  # once more: nothing to do, nothing to say


@pytest.mark.parametrize("stays", [True, False])
def test_a_session_can_keep_its_participant_from_node_to_node(session, stays):
    def participant():
        node = session.run(Talker)
        (end,) = node.get_publishers_info_by_topic("chatter")
        session.stop(node)
        return bytes(end.endpoint_gid[:12])

    if stays:
        session.participate()
    assert (participant() == participant()) is stays


def test_a_stopped_node_runs_no_callback_any_more(any_session):
    talker = any_session.run(Talker)
    any_session.until(lambda: talker.count)
    any_session.stop(talker)
    count = talker.count
    with pytest.raises(WaitTimeout):
        any_session.until(lambda: talker.count > count, timeout=0.1)


def test_a_name_that_never_ran_is_named_with_those_that_run(session):
    session.run(Talker)
    with pytest.raises(SessionError, match=r"'tolker'.*running now: /talker"):
        session.stop("tolker")


def test_stop_destroys_action_servers_too(session):
    def node_with_action():
        node = Node("doer")
        ActionServer(node, Fibonacci, "count", lambda goal: Fibonacci.Result())
        return node

    session.run(node_with_action)
    session.stop()
    with course.Session(domain_id=session.domain_id) as outside:
        watcher = outside.run(Node, "watcher")
        outside.until(lambda: "watcher" in watcher.get_node_names())
        assert not [name for name, _ in watcher.get_service_names_and_types() if "count" in name]


def test_a_method_with_a_name_of_rclpys_is_named(session):
    """rclpy only says that a 'method' object does not support the context manager protocol."""

    class SpeedServer(Node):
        def __init__(self):
            super().__init__("speed_server")
            self.create_service(SetBool, "speed", self.handle)

        def handle(self, request, response):
            return response

    with pytest.raises(TypeError, match=r"SpeedServer has its own 'handle', a name under which"):
        session.run(SpeedServer)


def test_a_factory_that_returns_no_node_is_one_sentence(session):
    with pytest.raises(SessionError, match=r"returns a node; .*returned str"):
        session.run(lambda: "camera")


def test_a_node_of_another_context_is_one_sentence(session):
    with course.Session() as other:
        stranger = other.run(Talker)
        with pytest.raises(SessionError, match="another rclpy context"):
            session.run(stranger)
        assert list(other.nodes) == ["/talker"]


def test_a_paused_node_receives_but_does_not_execute(any_session):
    listener = any_session.run(Listener)
    publisher = any_session.run(Node, "publisher").create_publisher(String, "chatter", 10)
    any_session.until(lambda: publisher.get_subscription_count() == 1)
    any_session.pause(listener)
    for number in range(5):
        publisher.publish(String(data=str(number)))
    with pytest.raises(WaitTimeout):
        any_session.until(lambda: listener.heard, timeout=0.1)
    any_session.resume(listener)
    any_session.until(lambda: len(listener.heard) == 5, what="what arrived during the pause")
    assert listener.heard == ["0", "1", "2", "3", "4"]


def test_what_a_node_brought_to_its_executor_is_paused_with_it(any_session):
    class Parent(Node):
        def __init__(self):
            super().__init__("parent")
            self.child = Listener()
            self.once = self.create_timer(0.0, self.adopt)

        def adopt(self):
            self.destroy_timer(self.once)
            self.executor.add_node(self.child)

        def destroy_node(self):
            self.child.destroy_node()
            super().destroy_node()

    parent, other = any_session.run(Parent), any_session.run(lambda: Talker("other"))
    publisher = any_session.run(Node, "publisher").create_publisher(String, "chatter", 10)
    any_session.until(lambda: publisher.get_subscription_count() == 1)
    any_session.until(lambda: parent.child.heard, what="the other talker")
    any_session.pause(parent)
    heard, said = len(parent.child.heard), other.count
    any_session.until(lambda: other.count > said + 20, what="what is nobody's child goes on")
    assert len(parent.child.heard) == heard
    any_session.resume(parent)
    any_session.until(lambda: len(parent.child.heard) > heard, what="what has queued up")


def test_nodes_can_be_run_and_stopped_from_a_callback(any_session):
    done = threading.Event()

    class Boss(Node):
        def __init__(self):
            super().__init__("boss")
            self.timer = self.create_timer(0.01, self.work)

        def work(self):
            self.timer.cancel()
            any_session.run(Talker, "first")
            any_session.run(Talker, "second")
            any_session.stop("first")
            any_session.stop(self)
            done.set()

    any_session.run(Boss)
    any_session.until(done.is_set)
    second = any_session.nodes["/second"]
    any_session.until(lambda: second.count)
    assert list(any_session.nodes) == ["/second"]
    assert any_session.errors == []


def test_a_callback_can_close_the_session():
    session = course.Session()

    class Quitter(Node):
        def __init__(self):
            super().__init__("quitter")
            self.create_timer(0.01, session.close)

    session.run(Quitter)
    session.until(lambda: session.closed)
    assert session.close()
    assert session.nodes == {}


def test_a_node_destroyed_by_hand_is_let_go_of(any_session):
    talker, listener = any_session.run(Talker), any_session.run(Listener)
    any_session.until(lambda: listener.heard)
    talker.destroy_node()
    assert list(any_session.nodes) == ["/listener"]
    again = any_session.run(Talker)
    any_session.until(lambda: again.count > 3)
    assert any_session.errors == []


def test_a_callback_that_outlives_a_node_destroyed_by_hand_is_no_news(any_session):
    begun, destroyed, over = threading.Event(), threading.Event(), threading.Event()

    class Slow(Talker):
        def say(self):
            begun.set()
            destroyed.wait(10)
            try:
                super().say()
            finally:
                over.set()

    slow = any_session.run(Slow)
    assert begun.wait(10)
    for publisher in list(slow.publishers)[:2]:  # as far as destroy_node() gets in between
        slow.destroy_publisher(publisher)
    destroyed.set()
    assert over.wait(10)
    slow.destroy_node()
    talker = any_session.run(Talker, "other")
    any_session.until(lambda: talker.count > 3)
    assert any_session.errors == []


def test_publishing_with_what_was_destroyed_is_told_of_a_node_that_lives(any_session):
    talker = any_session.run(Talker)
    talker.destroy_publisher(talker.publisher)
    any_session.until(lambda: any_session.errors)
    assert "InvalidHandle" in any_session.errors[0].problem


def test_entities_can_come_and_go_while_their_node_spins(any_session):
    talker = any_session.run(Talker)
    for _ in range(50):
        listener = any_session.run(Node, "listener")
        heard = []
        subscription = listener.create_subscription(String, "chatter", heard.append, 10)
        any_session.until(lambda heard=heard: heard)
        listener.destroy_subscription(subscription)
        listener.create_timer(0.001, lambda: None)
    count = talker.count
    any_session.until(lambda: talker.count > count)
    assert any_session.errors == []


def test_a_raising_callback_is_recorded_and_spinning_goes_on(any_session):
    class Stumbler(Talker):
        def say(self):
            super().say()
            if self.count <= 3:
                raise ValueError(f"stumbled at {self.count}")

    stumbler = any_session.run(Stumbler)
    any_session.until(lambda: stumbler.count > 5)
    any_session.until(lambda: sum(error.count for error in any_session.errors) == 3)
    (error,) = any_session.errors
    assert error.node == "/talker"
    assert error.callback.endswith("Stumbler.say")
    # In a pool, the thread of an earlier callback may be the later one to report.
    last = "3" if any_session.threads == 1 else "[123]"
    assert re.search(rf"raised ValueError: stumbled at {last} \(3 times\)", str(error))
    assert "rclpy" not in error.traceback
    assert "say" in error.traceback


def test_sys_exit_in_a_callback_is_recorded_too(any_session):
    class Quitter(Talker):
        def say(self):
            super().say()
            if self.count == 1:
                raise SystemExit(3)

    quitter = any_session.run(Quitter)
    any_session.until(lambda: quitter.count > 2)
    assert [type(error.exception) for error in any_session.errors] == [SystemExit]


def test_a_service_that_forgets_its_response_is_told_so(any_session):
    def server():
        node = Node("server")
        node.create_service(SetBool, "switch", lambda request, response: None)
        return node

    any_session.run(server)
    with pytest.raises(WaitTimeout, match=r"/switch did not answer.*did not return its response"):
        any_session.call(SetBool, "switch", SetBool.Request(), timeout=0.5)


def test_a_raising_execute_callback_is_recorded_and_the_goal_aborted(any_session, capfd):
    class Doer(Node):
        def __init__(self):
            super().__init__("doer")
            self.server = ActionServer(self, Fibonacci, "count", self.execute)

        def execute(self, goal):
            raise RuntimeError("out of fingers")

    any_session.run(Doer)
    goal = any_session.send_goal(Fibonacci, "count", Fibonacci.Goal(order=3))
    goal.wait()
    assert goal.status.name == "ABORTED"
    (error,) = any_session.errors
    assert (error.node, str(error.exception)) == ("/doer", "out of fingers")
    assert error.callback.endswith("Doer.execute")
    assert capfd.readouterr() == ("", "")


def test_a_done_callback_of_a_future_is_attributed_to_its_node(any_session):
    class Asker(Node):
        def __init__(self):
            super().__init__("asker")
            self.create_service(SetBool, "switch", lambda request, response: response)
            self.client = self.create_client(SetBool, "switch")
            self.timer = self.create_timer(0.01, self.ask)

        def ask(self):
            if self.client.service_is_ready():
                self.timer.cancel()
                self.client.call_async(SetBool.Request()).add_done_callback(self.answered)

        def answered(self, future):
            raise LookupError("unexpected")

    any_session.run(Asker)
    any_session.until(lambda: any_session.errors)
    error = any_session.errors[0]
    assert error.node == "/asker"
    assert error.callback.endswith("Asker.answered")


def test_a_stolen_node_is_taken_back_and_the_learner_told(session):
    import rclpy
    from rclpy.executors import SingleThreadedExecutor

    talker = session.run(Talker)
    thief = SingleThreadedExecutor(context=session.context)
    rclpy.spin_once(talker, executor=thief, timeout_sec=1.0)
    count = talker.count
    session.until(lambda: talker.count > count + 3, what="the node to spin again")
    (notice,) = session.notices
    assert "/talker was taken out of this session" in notice
    thief.shutdown()


def test_a_node_that_another_executor_holds_is_left_there(session):
    from rclpy.executors import SingleThreadedExecutor

    talker = session.run(Talker)
    holder = SingleThreadedExecutor(context=session.context)
    holder.add_node(talker)
    session.until(lambda: True)
    assert talker in holder.get_nodes()
    assert session.notices == []
    holder.remove_node(talker)
    holder.shutdown()


def test_a_session_can_be_joined_on_its_domain(session):
    session.run(Talker)
    with course.Session(domain_id=session.domain_id) as other:
        listener = other.run(Listener)
        other.until(lambda: listener.heard, timeout=10.0, what="a message across participants")


@pytest.mark.parametrize(
    ("options", "error", "sentence"),
    [
        ({"domain_id": 233}, DomainError, "domain 233 is out of range"),
        ({"threads": 0}, SessionError, "at least 1, not 0"),
        ({"discovery": "EVERYWHERE"}, SessionError, "LOCALHOST, SUBNET, SYSTEM_DEFAULT"),
    ],
)
def test_impossible_options_are_one_sentence(options, error, sentence):
    with pytest.raises(error, match=sentence):
        course.Session(**options)


def test_closing_ends_threads_nodes_and_lease_and_is_idempotent():
    before = threading.active_count()
    session = course.Session(threads=3)
    session.run(Talker)
    session.run(Listener, threads=1)
    report = session.close()
    assert report
    assert report.leaked == []
    assert session.close() is report
    assert (session.closed, session.nodes) == (True, {})
    assert threading.active_count() == before
    with pytest.raises(SessionError, match="closed"):
        session.run(Talker)
    with pytest.raises(SessionError, match="closed"):
        session.record("chatter", String)


def test_closing_reports_a_callback_that_does_not_end():
    release = threading.Event()

    class Sleeper(Talker):
        def say(self):
            super().say()
            release.wait(60.0)

    session = course.Session()
    sleeper = session.run(Sleeper)
    session.until(lambda: sleeper.count)
    report = session.close(timeout=0.2)
    release.set()
    assert not report
    assert len(report.leaked) == 1
    assert "a callback of /talker" in report.leaked[0]


def test_a_wait_that_ends_in_vain_says_what_for_and_what_went_wrong(session):
    class Stumbler(Talker):
        def say(self):
            raise ValueError("no lens")

    session.run(Stumbler)
    with pytest.raises(WaitTimeout, match=r"0\.3 s in vain for a picture\. Meanwhile .*no lens"):
        session.until(lambda: False, timeout=0.3, what="a picture")


def test_until_returns_the_value_of_the_condition(session):
    values = iter([0, "", None, "here"])
    assert session.until(lambda: next(values)) == "here"
