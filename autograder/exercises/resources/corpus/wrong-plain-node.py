# title: States in a variable of a plain node, without a state machine that others can drive
# fails: driver_runs, managed_runs
# says: driver_runs: takes 1 positional argument but 2 were given
# says: managed_runs: Your node answers its service /managed_camera/get_state.


class CameraDriver(Node):
    def __init__(self):
        super().__init__('camera_driver')


# %% resources-lifecycle
class ManagedCamera(Node):
    def __init__(self):
        super().__init__('managed_camera')
        self.state = 'unconfigured'
        self.declare_parameter('device', 'front')
        self.declare_parameter('rate', 10.0)

    def configure(self):
        self.camera = Camera(self.get_parameter('device').value)
        self.state = 'inactive'
