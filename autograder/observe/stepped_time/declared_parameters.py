"""A number that is set over the ROS graph: a node's parameter, or by a service of its own.

Nothing is known of the node but what the graph shows: its parameter services, named after it.
"""

from __future__ import annotations

from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python

from autograder.examination.exam import Failed
from autograder.observe.nouns import Parameter
from autograder.observe.observed_node import Change
from autograder.observe.stepped_time.stepped_observer import SteppedObserver

SET_PARAMETERS = "rcl_interfaces/srv/SetParameters"


class DeclaredParameter:
    """A number under the name of a parameter, whoever has it.

    Attributes:
        last_set: the value that was accepted last, or None.
    """

    def __init__(self, observer: SteppedObserver, parameter: Parameter, own_service: str) -> None:
        """Look for it when it is asked for.

        Args:
            observer: whose time passes while an answer is waited for.
            parameter: its name, and what it is when nobody has set it.
            own_service: the full name of a service of type ``SetParameters`` that sets it where no
                node has declared it: then it cannot be read.
        """
        self.parameter = parameter
        self._observer, self._own_service = observer, own_service
        self.last_set: float | None = None

    def find_node(self) -> str | None:
        """Return the full name of a node that has declared it, or None (as yet)."""
        graph = self._observer.node
        for name, types in graph.get_service_names_and_types():
            node = str(name).removesuffix("/set_parameters")
            # A service of the student's own has another name, and is found under that.
            is_node = types == [SET_PARAMETERS] and node != name and graph.count_services(name)
            if is_node and self._read(node) is not None:
                return node
        return None

    def get(self) -> float | None:
        """Return its value, or None if no node has declared it as a number."""
        node = self.find_node()
        return None if node is None else self._read(node)

    def require(self, value: float) -> None:
        """Require that it has a value, if it can be read.

        Raises:
            Failed: it has another one.
        """
        present = self.get()
        if present not in (None, value):
            raise Failed(
                expected=f"The parameter `{self.parameter}` is {value:g}.",
                actual=f"It is {present:g}.",
            )

    def set(self, value: float) -> Change:
        """Ask for a new value, and return what became of that.

        Raises:
            Failed: there was no answer, or not one result for one parameter.
        """
        node, before = self.find_node(), self.get()
        service = self._own_service if node is None else f"{node}/set_parameters"
        message = RosParameter(self.parameter.name, value=value).to_parameter_msg()
        request = SetParameters.Request(parameters=[message])
        answer = self._observer.call(SetParameters, service, request)
        if answer is None or len(answer.results) != 1:
            what = "did not answer" if answer is None else f"gave {len(answer.results)} results"
            raise Failed(
                expected=f"A request to set `{self.parameter}` gets one answer: taken, or refused "
                "with a reason.",
                actual=f"Asked for {value:g}, {service} {what}{self._observer.error_note()}.",
            )
        (result,) = answer.results
        if result.successful:
            self.last_set = value
        present = self.get() if node else value if result.successful else before
        return Change(
            self.parameter, value, bool(result.successful), str(result.reason), present, before
        )

    def _read(self, node: str) -> float | None:
        # Whoever answers with something else than one value for one name has none.
        name = f"{node}/get_parameters"
        if not self._observer.node.count_services(name):
            return None
        request = GetParameters.Request(names=[self.parameter.name])
        answer = self._observer.call(GetParameters, name, request)
        if answer is None or len(answer.values) != 1:
            return None
        value = parameter_value_to_python(answer.values[0])
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return float(value) if is_number else None
