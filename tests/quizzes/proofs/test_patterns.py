"""Proofs: what a topic is, and what it costs to hand out a stream in other ways."""

from __future__ import annotations

import os

from std_msgs.msg import Int32, String
from std_srvs.srv import Trigger

from course.runtime.domains.leases import lease_domain


def listen(node, topic="images"):
    heard = []
    node.create_subscription(String, topic, lambda message: heard.append(message.data), 10)
    return heard


def test_one_publish_reaches_every_matched_subscriber(ros):
    publisher = ros.node("camera").create_publisher(String, "images", 10)
    heard = [listen(ros.node(name)) for name in ("detection", "mapping", "recording")]
    ros.matched(publisher, 3)
    images = [f"image {number}" for number in range(30)]
    calls = 0
    for image in images:
        publisher.publish(String(data=image))
        calls += 1
        ros.until(lambda image=image: all(h[-1:] == [image] for h in heard), "the image")
    assert calls == 30
    assert heard == [images, images, images]


def test_a_service_costs_one_answer_for_each_consumer_and_image(ros):
    answered = []

    def answer(request, response):
        answered.append(request)
        return response

    ros.node("camera").create_service(Trigger, "next_image", answer)
    clients = [ros.node(f"consumer_{n}").create_client(Trigger, "next_image") for n in range(3)]
    ros.until(lambda: all(client.service_is_ready() for client in clients), "the service")
    for _ in range(10):
        futures = [client.call_async(Trigger.Request()) for client in clients]
        ros.until(lambda futures=futures: all(f.done() for f in futures), "the responses")
    assert len(answered) == 30


def test_nodes_of_one_process_exchange_messages(ros):
    camera, detector = ros.node("camera"), ros.node("detector")
    publisher = camera.create_publisher(String, "images", 10)
    heard = []
    detector.create_subscription(
        String, "images", lambda message: heard.append((message.data, os.getpid())), 10
    )
    ros.matched(publisher)
    publisher.publish(String(data="image 1"))
    ros.until(lambda: heard, "the image")
    assert heard == [("image 1", os.getpid())]
    assert {"camera", "detector"} <= set(camera.get_node_names())


def test_two_participants_find_each_other_without_a_third(ros):
    other = ros.participant()
    camera, detector = ros.node("camera"), other.node("detector")
    publisher = camera.create_publisher(String, "images", 10)
    heard = listen(detector)
    ros.matched(publisher)
    publisher.publish(String(data="image 1"))
    ros.until(lambda: heard == ["image 1"], "the image")
    # Endpoints match before either side hears by what name the other's node goes: wait on both.
    ros.until(lambda: "camera" in detector.get_node_names(), "the graph as the detector sees it")
    ros.until(lambda: "detector" in camera.get_node_names(), "the graph as the camera sees it")
    # A leased domain: had anything else to run for this, it would stand here.
    assert sorted(detector.get_node_names()) == ["camera", "detector"]
    assert sorted(camera.get_node_names()) == ["camera", "detector"]


def test_a_late_subscriber_gets_what_is_sent_from_the_match_on(ros):
    publisher = ros.node("camera").create_publisher(String, "images", 10)
    publisher.publish(String(data="before anybody was there"))
    heard = listen(ros.node("detector"))
    ros.matched(publisher)
    for number in (2, 3):
        publisher.publish(String(data=f"image {number}"))
    ros.until(lambda: len(heard) == 2, "both images")
    assert heard == ["image 2", "image 3"]


def test_another_name_type_or_domain_does_not_connect(ros):
    lease = lease_domain()
    elsewhere = ros.participant(domain_id=lease.domain_id)
    other_domain = listen(elsewhere.node("elsewhere"))
    listener = ros.participant().node("listener")
    other_name = listen(listener, "pictures")
    other_type = []
    numbers = ros.participant().node("numbers")  # one participant knows a topic by one type only
    numbers.create_subscription(Int32, "images", other_type.append, 10)
    publisher = ros.node("camera").create_publisher(String, "images", 10)
    control = listen(listener)  # the last to come, and the only one that fits
    ros.matched(publisher, 1)
    publisher.publish(String(data="image 1"))
    ros.until(lambda: control == ["image 1"], "the image")
    assert (other_domain, other_name, other_type) == ([], [], [])
    assert publisher.get_subscription_count() == 1
    ros.drop(elsewhere)
    lease.release()


def test_publishing_gives_no_answer(ros):
    publisher = ros.node("sender").create_publisher(String, "drive_to", 10)
    assert publisher.get_subscription_count() == 0
    assert publisher.publish(String(data="charger")) is None  # nobody is there; no complaint
    heard = listen(ros.node("robot"), "drive_to")
    ros.matched(publisher)
    assert publisher.publish(String(data="charger")) is None
    ros.until(lambda: heard == ["charger"], "the message")
