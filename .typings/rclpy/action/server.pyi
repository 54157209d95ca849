from collections.abc import Callable
from enum import Enum
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.waitable import Waitable

class GoalResponse(Enum):
    REJECT = 1
    ACCEPT = 2

class CancelResponse(Enum):
    REJECT = 1
    ACCEPT = 2

class ServerGoalHandle:
    def __init__(self, action_server: ActionServer, goal_info: Any, goal_request: Any) -> None: ...
    @property
    def request(self) -> Any: ...
    @property
    def goal_id(self) -> Any: ...
    @property
    def is_active(self) -> bool: ...
    @property
    def is_cancel_requested(self) -> bool: ...
    @property
    def status(self) -> int: ...
    def execute(
        self, execute_callback: Callable[[ServerGoalHandle], Any] | None = None
    ) -> None: ...
    def publish_feedback(self, feedback: Any) -> None: ...
    def succeed(self) -> None: ...
    def abort(self) -> None: ...
    def canceled(self) -> None: ...
    def destroy(self) -> None: ...

class ActionServer(Waitable):
    _handle: Any
    def __init__(
        self,
        node: Node,
        action_type: Any,
        action_name: str,
        execute_callback: Callable[[ServerGoalHandle], Any],
        *,
        callback_group: CallbackGroup | None = None,
        goal_callback: Callable[[Any], Any] | None = ...,
        handle_accepted_callback: Callable[[ServerGoalHandle], Any] | None = ...,
        cancel_callback: Callable[[ServerGoalHandle], Any] | None = ...,
        goal_service_qos_profile: QoSProfile = ...,
        result_service_qos_profile: QoSProfile = ...,
        cancel_service_qos_profile: QoSProfile = ...,
        feedback_pub_qos_profile: QoSProfile = ...,
        status_pub_qos_profile: QoSProfile = ...,
        result_timeout: int = 900,
    ) -> None: ...
    async def _execute_cancel_request(self, request_header_and_message: Any) -> None: ...
    async def _execute_get_result_request(self, request_header_and_message: Any) -> None: ...
    @property
    def action_type(self) -> Any: ...
    def register_cancel_callback(
        self, cancel_callback: Callable[[ServerGoalHandle], Any] | None
    ) -> None: ...
    def destroy(self) -> None: ...
