# title: The stub's four nodes, with nothing in their methods
# fails: the first
# says: gripper_answers: the gripper was not called. It said nothing
# says: speed_serves: No answer came.
# points: 0

class GripperClient(Node):
    def __init__(self):
        super().__init__('gripper_client')
        self.gripper = self.create_client(SetBool, 'gripper/set')
        self.outcome = self.create_publisher(String, 'grip/outcome', 10)
        self.hold = self.create_publisher(Empty, 'arm/hold', 10)
        self.heartbeat = self.create_publisher(Empty, 'grip/heartbeat', 10)
        self.create_subscription(Bool, 'grip/request', self.on_request, 10)

    async def on_request(self, request):
        pass

# %% safety-speed
class SpeedServer(Node):
    def __init__(self):
        super().__init__('speed_server')
        self.wheels = Wheels(self)
        self.create_service(SetParametersAtomically, 'speed/set', self.on_request)

    def on_request(self, request, response):
        pass

# %% safety-goals
class NavigationClient(Node):
    def __init__(self):
        super().__init__('navigation_client')
        self.navigator = ActionClient(self, Drive, 'navigate')
        self.outcome = self.create_publisher(String, 'navigate/outcome', 10)
        self.cmd_vel = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_subscription(Int32, 'navigate/request', self.on_request, 10)

    async def on_request(self, request):
        pass

# %% safety-drive
class NavigationServer(Node):
    def __init__(self):
        super().__init__('navigation_server')
        self.wheels = Wheels(self)
        self.server = ActionServer(self, Drive, 'drive', execute_callback=self.execute)

    async def execute(self, goal_handle):
        pass

    def shutdown(self):
        pass
