from enum import Enum, IntEnum
from typing import Any

from rclpy.duration import Duration

class QoSPolicyKind(IntEnum):
    INVALID = 1
    DURABILITY = 2
    DEADLINE = 4
    LIVELINESS = 8
    RELIABILITY = 16
    HISTORY = 32
    LIFESPAN = 64
    DEPTH = 128
    LIVELINESS_LEASE_DURATION = 256
    AVOID_ROS_NAMESPACE_CONVENTIONS = 512

def qos_policy_name_from_kind(policy_kind: QoSPolicyKind | int) -> str: ...

class InvalidQoSProfileException(Exception):  # noqa: N818 - a name of rclpy's
    def __init__(self, *args: object) -> None: ...

class QoSProfile:
    __slots__: list[str]
    history: HistoryPolicy
    depth: int
    reliability: ReliabilityPolicy
    durability: DurabilityPolicy
    lifespan: Duration
    deadline: Duration
    liveliness: LivelinessPolicy
    liveliness_lease_duration: Duration
    avoid_ros_namespace_conventions: bool
    def __init__(self, **kwargs: Any) -> None: ...
    def get_c_qos_profile(self) -> Any: ...

class QoSPolicyEnum(IntEnum):  # type: ignore[misc]  # a base without members
    @classmethod
    def short_keys(cls) -> list[str]: ...
    @classmethod
    def get_from_short_key(cls, name: str) -> int: ...
    @property
    def short_key(self) -> str: ...

class HistoryPolicy(QoSPolicyEnum):
    SYSTEM_DEFAULT = 0
    KEEP_LAST = 1
    KEEP_ALL = 2
    UNKNOWN = 3

class ReliabilityPolicy(QoSPolicyEnum):
    SYSTEM_DEFAULT = 0
    RELIABLE = 1
    BEST_EFFORT = 2
    UNKNOWN = 3
    BEST_AVAILABLE = 4

class DurabilityPolicy(QoSPolicyEnum):
    SYSTEM_DEFAULT = 0
    TRANSIENT_LOCAL = 1
    VOLATILE = 2
    UNKNOWN = 3
    BEST_AVAILABLE = 4

class LivelinessPolicy(QoSPolicyEnum):
    SYSTEM_DEFAULT = 0
    AUTOMATIC = 1
    MANUAL_BY_TOPIC = 3
    UNKNOWN = 4
    BEST_AVAILABLE = 5

QoSHistoryPolicy = HistoryPolicy
QoSReliabilityPolicy = ReliabilityPolicy
QoSDurabilityPolicy = DurabilityPolicy
QoSLivelinessPolicy = LivelinessPolicy

qos_profile_default: QoSProfile
qos_profile_sensor_data: QoSProfile
qos_profile_services_default: QoSProfile
qos_profile_parameters: QoSProfile
qos_profile_parameter_events: QoSProfile
qos_profile_action_status_default: QoSProfile

class QoSPresetProfiles(Enum):
    UNKNOWN = ...
    DEFAULT = ...
    SYSTEM_DEFAULT = ...
    SENSOR_DATA = ...
    SERVICES_DEFAULT = ...
    PARAMETERS = ...
    PARAMETER_EVENTS = ...
    ACTION_STATUS_DEFAULT = ...
    BEST_AVAILABLE = ...
    @classmethod
    def short_keys(cls) -> list[str]: ...
    @classmethod
    def get_from_short_key(cls, name: str) -> QoSProfile: ...

QoSCompatibility: Any  # an enum of C++

def qos_check_compatible(
    publisher_qos: QoSProfile, subscription_qos: QoSProfile
) -> tuple[Any, str]: ...
