"""The examiner's end of a task: a new node meets nothing that an earlier one was told through."""

from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import SetBool

from autograder.observe.examiner.examiner_end import ExaminerEnd
from autograder.observe.nouns import Service, Topic

WORDS, GRIP, MODE = Topic("words", String), Service("grip", SetBool), Service("mode", SetBool)


def test_a_new_node_meets_no_writer_that_has_said_something(session):
    end = session.run(ExaminerEnd)
    node = session.run(Node, "arm")
    node.create_service(SetBool, "grip", lambda request, response: response)
    end.serve(MODE)
    first = end.publisher(WORDS), end.client_of("/grip", SetBool)
    session.until(first[1].service_is_ready)
    session.until(first[1].call_async(SetBool.Request()).done)
    asked = node.create_client(SetBool, "mode")
    session.until(asked.service_is_ready)
    answer = asked.call_async(SetBool.Request())
    session.until(lambda: end.requests(MODE))
    end.forget()
    session.until(answer.done)

    end.disconnect()
    session.until(lambda: not node.count_publishers("/words"))
    session.until(lambda: not node.count_clients("/grip") and not node.count_services("/mode"))
    end.serve(MODE)
    assert end.publisher(WORDS) is not first[0]
    assert end.client_of("/grip", SetBool) is not first[1]
    session.until(asked.service_is_ready)
