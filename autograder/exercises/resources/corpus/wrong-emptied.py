# title: Two nodes that start, and do nothing
# fails: driver_runs, managed_runs
# says: driver_runs: Your process has not opened that camera.
# says: managed_runs: Your process has not opened that camera.
# points: 0

class CameraDriver(Node):
    def __init__(self, device='front'):
        super().__init__('camera_driver')

    def destroy_node(self):
        super().destroy_node()

# %% resources-lifecycle
class ManagedCamera(LifecycleNode):
    def __init__(self):
        super().__init__('managed_camera')
        self.declare_parameter('device', 'front')
        self.declare_parameter('rate', 10.0)

    def on_configure(self, state):
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state):
        return TransitionCallbackReturn.SUCCESS
