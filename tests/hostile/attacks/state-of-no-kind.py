# title: A managed camera whose state is called as none is, until it is to be shut down
# reaches: the exam
# exercise: resources
# base: right-exemplar
# score: 14
# told: It says that its state is “hovering”

_Managed = ManagedCamera


class ManagedCamera(_Managed):
    began = False

    def on_configure(self, state):
        self.began = True
        return super().on_configure(state)

    def _LifecycleNodeMixin__on_get_state(self, request, response):
        response.current_state.id, response.current_state.label = self._state_machine.current_state
        if not self.began:
            response.current_state.label = "hovering"
        return response
