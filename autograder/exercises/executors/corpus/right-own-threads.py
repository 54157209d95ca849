# title: Callbacks that only hand their work to threads of the node's own
# fails: nothing

import queue


class Guard(Node):
    def __init__(self):
        super().__init__('guard')
        self.book = Logbook()
        self.beats = self.create_publisher(Int32, 'safety/beat', 10)
        self.reports = self.create_publisher(String, 'report', 10)
        self.results = self.create_publisher(Int32, 'result', 10)
        self.handled = self.create_publisher(Int32, 'handled', 10)
        self.count = 0
        self.create_timer(0.05, self.beat)
        self.client = self.create_client(Trigger, 'inspection')
        self.create_subscription(String, 'inspect', self.inspect, 10)
        self.work = queue.SimpleQueue()
        self.create_subscription(Int32, 'scan', lambda scan: self.work.put(scan.data), 10)
        threading.Thread(target=self.run, daemon=True).start()

    def beat(self):
        self.count += 1
        self.beats.publish(Int32(data=self.count))

    def inspect(self, part):
        future = self.client.call_async(Trigger.Request())
        future.add_done_callback(lambda done: self.work.put(done.result().message))

    def run(self):
        while (item := self.work.get()) is not None:
            if isinstance(item, str):
                self.reports.publish(String(data=item))
            else:
                self.results.publish(Int32(data=analyse(self, item)))
            number = self.book.read() + 1
            self.book.write(number)
            self.handled.publish(Int32(data=number))

    def destroy_node(self):
        self.work.put(None)
        super().destroy_node()
