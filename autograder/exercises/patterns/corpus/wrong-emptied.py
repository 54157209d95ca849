# title: The robot's interface with nothing in it
# fails: choices_made, camera_streams, position_answered, parameter_changes, battery_broadcast, navigation_drives
# says: choices_made: position is still open
# says: battery_broadcast: robot/battery
# points: 0

class RobotInterface(Robot):
    def __init__(self):
        super().__init__('robot_interface')

    def charge_changed(self):
        pass
