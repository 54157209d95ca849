"""Following marks through a robot: how far they got, and by which way."""

from __future__ import annotations

from collections.abc import Iterable

from autograder.examination.exam import Failed
from autograder.exercises.architecture.link_faults import join_names, name_nodes
from autograder.exercises.architecture.rig import ArchitectureRig
from autograder.exercises.architecture.robot_graph import Topic
from autograder.exercises.architecture.robot_roles import MOTORS
from autograder.exercises.architecture.tracing import Poured
from autograder.observe.phrases import callback_raised

READINGS = {"/scan": "a scan", "/camera/image": "an image"}


def describe_lost_mark(rig: ArchitectureRig, poured: Poured, wanted: Iterable[str]) -> str:
    """Return how far the dye got instead, and what the student's callbacks raised."""
    there = join_names(wanted, "or")
    way = f"{join_names(poured.lost_on)}, but" if poured.lost_on else "no topic, and so"
    where = f"It was seen on {way} never on {there}"
    if poured.arrived:
        others = (
            f"; the others were seen on {way} never there" if poured.marks > poured.arrived else ""
        )
        where = f"Of {poured.marks} marks {poured.arrived} was seen on {there}{others}"
    if poured.aside:
        where += f"; {poured.aside}"
    return f"{where}{error_note(rig)}."


def error_note(rig: ArchitectureRig) -> str:
    """Return what the student's callbacks raised, as the end of a sentence."""
    errors = rig.subject.errors()
    return f"; {callback_raised(errors[-1])}" if errors else ""


def require_plans(rig: ArchitectureRig) -> None:
    """Fail if path planning never answers.

    Whoever has a node of the library ask does not notice. By now goals have been driven to, so one
    that raised before it had a map, say, can answer.
    """
    services = rig.jobs.planning_services
    if not services or any(rig.gets_answer(offer) for offer in services):
        return
    errors = rig.subject.errors()
    faults = [e for e in errors for o in services for n in o.servers if f" of {n}: " in e]
    why = f"; {callback_raised(faults[-1])}" if faults else ""
    raise Failed(
        expected="Path planning answers each request: its callback returns the response that "
        "it was given.",
        actual=f"{join_names([offer.name for offer in services])} did not answer a request{why}.",
    )


def see_scan_arrive(rig: ArchitectureRig, topics: dict[str, Topic]) -> None:
    """Follow the mark of a scan to obstacle information, and from just there to the motors.

    What the scan's mark does not get to is no way for it: where one way is a dead end, the others
    are tried by themselves.
    """
    lost: Failed | None = None
    while topics:
        eye = rig.jobs.source_sensor(topics.values())
        poured = rig.colour_topics([rig.graph.get_topic(eye)], topics)
        if not poured.enough:
            raise lost or Failed(
                expected=f"The mark of {READINGS[eye]} on {eye} is seen on "
                f"{join_names(topics, 'or')}.",
                actual=describe_lost_mark(rig, poured, topics),
            )
        reached = [topic for name, topic in topics.items() if rig.seen[name] & poured.tags]
        names = [topic.name for topic in reached]
        poured = rig.colour_topics(reached, [MOTORS])
        if poured.enough:
            _see_stream(rig, poured, names)
            return
        lost = lost or Failed(
            expected=f"The mark of a message on {join_names(names, 'or')} is seen on {MOTORS}.",
            actual=describe_lost_mark(rig, poured, [MOTORS]),
        )
        topics = {name: topic for name, topic in topics.items() if name not in names}
    assert lost is not None
    raise lost


def _see_stream(rig: ArchitectureRig, poured: Poured, names: list[str]) -> None:
    """Fail if what arrived at the motors came by no topic that their node reads: it was asked for.

    A node that carries out goals gets it with these.
    """
    last = [topic for topic in rig.graph.topics.values() if topic.read_by & rig.jobs.controllers]
    by_goal = any(rig.jobs.controllers & offer.servers for offer in rig.graph.actions.values())
    if by_goal or not last or not all(rig.knows_type(topic) for topic in last):
        return
    if not rig.wait(lambda: any(rig.seen[topic.name] & poured.tags for topic in last)):
        raise Failed(
            expected=f"What is on {join_names(names, 'or')} gets to {MOTORS} over topics or action "
            "goals.",
            actual=f"Its mark was seen on {MOTORS}, but on no topic that "
            f"{name_nodes(rig.jobs.controllers)} reads "
            f"({join_names([t.name for t in last], 'and')}): it "
            "came with a request of a service, or an answer, only when somebody asked.",
        )
