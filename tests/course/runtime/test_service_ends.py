"""A service is known when its requests and its replies are: what is sent before may be dropped."""

from rclpy.node import Node
from std_srvs.srv import SetBool

from course.runtime.requests.service_ends import (
    count_known_clients,
    count_known_servers,
    reply_topic,
    request_topic,
)


def test_both_ends_are_counted_until_they_are_gone(session):
    observer = session.observer
    served, used = session.run(Node, "arm"), session.run(Node, "hand")
    service = served.create_service(SetBool, "grip", lambda request, response: response)
    session.until(lambda: count_known_servers(observer, "/grip") == 1)
    assert count_known_clients(observer, "/grip") == 0
    client = used.create_client(SetBool, "grip")
    session.until(lambda: count_known_clients(observer, "/grip") == 1)
    used.destroy_client(client)
    session.until(lambda: count_known_clients(observer, "/grip") == 0)
    served.destroy_service(service)
    session.until(lambda: count_known_servers(observer, "/grip") == 0)


def test_the_topics_of_a_service_are_those_of_dds(session):
    node = session.run(Node, "arm")
    service = node.create_service(SetBool, "grip", lambda request, response: response)
    assert service.service_name == "/grip"
    session.until(lambda: count_known_servers(node, "/grip"))
    for topic in request_topic("/grip"), reply_topic("/grip"):
        counted = node.count_publishers, node.count_subscribers
        assert [count(topic) for count in counted] == [0, 0]  # they are none of ROS's own
        read = node.get_subscriptions_info_by_topic(topic, no_mangle=True)
        written = node.get_publishers_info_by_topic(topic, no_mangle=True)
        assert len([*read, *written]) == 1
