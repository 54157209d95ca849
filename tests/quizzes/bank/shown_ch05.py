"""What each `show` cell of chapter 5 must print to correct the beliefs that it is offered for.

{cell: {misconception: a regular expression that its output matches}}. A cell is named by the first
place where it stands. If a belief were true, its expression would not match.
"""

from __future__ import annotations

NEWEST_ONLY = r"the first three before.*heard by the late subscriber: \['message 4'\]$"
BOTH_SIDES = (
    r"VOLATILE, requested TRANSIENT_LOCAL: matched 0, heard \[\]\n"
    r"offered TRANSIENT_LOCAL, requested VOLATILE: matched 1, heard \['the present'\]\n"
    r".*heard \['the past', 'the present'\]$"
)
UNSPUN = r"matched: 1\ndelivered by DDS: True\n.*node: None\ncallbacks so far: 0\n.* spun: 1$"
ONE_CALL = (
    r"called once; heard by {'detection': \['image 1'\], 'mapping': \['image 1'\], 'recording'"
)
CALLED_BACK = r"inside the callback: +response: None\ncall_async\(\).*success=True"
PROGRESS = (
    r"service: one response, 'arrived'\naction: feedback \[\[0\], \[1\], \[2\]\] and then a res"
)
FOUR_ROUNDS = (
    r"feedback messages: 4\n( +\[0, 1, 1.*\]\n){4}result, separately: \[0, 1, 1, 2, 3, 5\]$"
)
RUNS_ON = (
    r"agreed to cancel: True\n.*done: False - finished so far: \[\]\nlater: \['the step was fi"
)

SHOWN: dict[str, dict[str, str]] = {
    "qos-purpose-1/topic-stores-messages": {
        "topic-stores-messages": NEWEST_ONLY,
        "depth-serves-late-joiners": NEWEST_ONLY,
    },
    "qos-purpose-1/qos-must-be-equal": {
        "qos-must-be-equal": r"RELIABLE with depth 10\n.*BEST_EFFORT .*\nThey match.*\['hello'\]$",
    },
    "qos-purpose-1/qos-sets-rate": {"qos-sets-rate": r"depth 1: +50\n +with depth 50: 50$"},
    "qos-purpose-2/best-effort-satisfies-reliable": {
        "best-effort-satisfies-reliable": r"RELIABILITY\nsubscribers matched: 0\nmess.* heard: 0$",
    },
    "qos-purpose-2/transient-local-one-side": {
        "transient-local-one-side": BOTH_SIDES,
        "topic-stores-messages": BOTH_SIDES,
    },
    "qos-purpose-3/depth-affects-matching": {
        "depth-affects-matching": r"^(publisher's depth \d+, subscriber's .* \d+: matched\n?){3}$",
    },
    "qos-purpose-3/publisher-decides": {
        "publisher-decides": r"VOLATILE: heard \['the present'\]\n.*: heard \['the past', 'the p",
    },
    "pattern-camera-1/services-suit-streams": {
        "services-suit-streams": r"30 received by topic\n.*publish\(\): 10\nrequests .*answer: 30$",
    },
    "pattern-camera-1/action-for-everything": {
        "action-for-everything": r"topic: \['/images'\]\nfor the action:\n( +/stream/\S+\n?){5}$",
    },
    "pattern-camera-1/topic-is-one-to-one": {
        "topic-is-one-to-one": ONE_CALL,
        "messages-are-shared-out": ONE_CALL,
    },
    "pattern-camera-2/one-node-one-process": {
        "one-node-one-process": r"'/camera', '/detector'\]\n.* from process (\d+) .*in process \1$",
    },
    "pattern-camera-2/broker-must-run": {
        "broker-must-run": r"domain: \['camera', 'detector'\]\n.*heard \['image 1'\]$",
    },
    "pattern-camera-2/subscriber-must-be-first": {
        "subscriber-must-be-first": r"camera was first, and the detector heard \['image 2'\]$",
    },
    "pattern-camera-5/topics-for-everything": {
        "topics-for-everything": r"subscribers 0 - answer: None\n.*accepted True - ended as SUCCEE",
    },
    "pattern-camera-6/callbacks-without-spinning": {
        "callbacks-without-spinning": UNSPUN,
        "unspun-node-is-absent": UNSPUN,
    },
    "reliable-guarantee-1/reliable-is-on-time": {
        "reliable-is-on-time": r"RELIABLE - .* 0.1 s\nmessages heard: 1\n.* missed so far: [1-9]",
    },
    "reliable-guarantee-1/reliable-keeps-everything": {
        "reliable-keeps-everything": r"30 messages while .*\nheard 10: from 21 to 30$",
        "depths-add-up": r"depth 10; 30 messages .*\nheard 10: from 21 to 30$",
    },
    "reliable-guarantee-3/mismatch-is-an-error": {
        "mismatch-is-an-error": r"RELIABILITY\nerrors .*: \[\]\nnodes .*: \['/lidar', '/mapper'\]$",
    },
    "reliable-guarantee-4/publish-waits": {
        "publish-waits": r"returned 5 times; callbacks so far: 0\ncallbacks in the end: 5$",
    },
    "reliable-guarantee-5/publisher-decides": {
        "publisher-decides": r"sent 300 .*RELIABLE got 300\n.*BEST_EFFORT got [12]?\d?\d$",
    },
    "pattern-navigation-1/action-is-slow-service": {"action-is-slow-service": PROGRESS},
    "pattern-navigation-2/acceptance-is-result": {
        "acceptance-is-result": r"True - state: EXECUTING - result: None\nstate: SUCCEEDED - res",
    },
    "pattern-navigation-3/cancel-needs-no-consent": {
        "cancel-needs-no-consent": r"agreed: False, the goal ended as SUCCEEDED\n",
        "action-is-slow-service": r"agreed: True, the goal ended as CANCELED$",
    },
    "pattern-navigation-3/cancel-stops-at-once": {
        "cancel-stops-at-once": RUNS_ON,
        "cancel-is-local": RUNS_ON + r"nished', 'then the code looked, and stopped'\].*CANCELED$",
    },
    "pattern-navigation-3/cancel-is-failure": {
        "cancel-is-failure": r"agrees: +CANCELED\n.*declines: SUCCEEDED\n.*gives up: +ABORTED$",
    },
    "pattern-navigation-4/feedback-is-automatic": {
        "feedback-is-automatic": FOUR_ROUNDS,
        "action-is-slow-service": FOUR_ROUNDS,
    },
    "service-vs-action-1/service-always-blocks": {
        "service-always-blocks": r"returned; the response is here: False\n.*\nnow it is: here you",
    },
    "service-vs-action-1/service-queues-requests": {
        "service-queues-requests": r"existed, answered: False\nrequest .*wards, answered: True$",
    },
    "service-vs-action-2/sync-call-in-callback-is-safe": {
        "sync-call-in-callback-is-safe": CALLED_BACK,
        "failed-call-returns-response": CALLED_BACK,
    },
    "service-vs-action-2/broker-must-run": {
        "broker-must-run": r"domain: \['client', 'server'\]\n.*found the service: True\n.*: True$",
    },
    "service-vs-action-3/sync-call-in-callback-is-safe": {
        "sync-call-in-callback-is-safe": r"answered 1 request\nthe client's call returned None$",
    },
    "service-vs-action-3/threads-are-enough": {
        "threads-are-enough": r"the default group: None\n.*a group of its own: .*Response\(",
    },
    "service-vs-action-4/result-is-certain": {
        "result-is-certain": r"^accepted: True - .*\nno result: The goal on drive has no result",
    },
}
