# title: The stub's two nodes with nothing in them
# fails: nodes_start
# says: nodes_start: There is no subscription to hardware/camera.
# points: 0

class SensorDrivers(Relay):
    def __init__(self):
        super().__init__('sensor_drivers')


class SensorConsumers(Relay):
    def __init__(self):
        super().__init__('sensor_consumers')
