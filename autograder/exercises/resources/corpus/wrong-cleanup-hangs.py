# title: Cleanup that waits for a thread which nobody tells to end
# fails: driver_runs
# says: driver_runs: a cleanup wait for ever?
# says: managed_runs: Your program hung or ended in
# seconds: 15


class CameraDriver(Node):
    def __init__(self, device='front'):
        super().__init__('camera_driver')
        self.camera = Camera(device)
        self.camera.start()
        self.images = self.create_publisher(Image, 'camera/image', 10)
        self.create_subscription(Int32, 'camera/zoom', lambda m: self.camera.zoom(m.data), 10)
        self.create_service(Trigger, 'camera/snapshot', self.snapshot)
        self.orders = queue.Queue()
        self.worker = threading.Thread(target=self.work, daemon=True)
        self.worker.start()
        self.create_timer(0.1, lambda: self.orders.put(1))

    def work(self):
        while True:
            self.orders.get()
            self.images.publish(self.camera.read())

    def snapshot(self, request, response):
        self.orders.put(1)
        response.success = True
        return response

    def destroy_node(self):
        self.worker.join()
        self.camera.close()
        super().destroy_node()
