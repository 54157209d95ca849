# title: Two classes: one that keeps the count, and one that does everything else
# fails: nothing

class Tally:
    def __init__(self, node):
        self.book, self.lock = node.book, threading.RLock()
        self.publisher = node.create_publisher(Int32, 'handled', 10)

    def add(self):
        with self.lock:
            self.book.write(self.book.read() + 1)
            self.publisher.publish(Int32(data=self.book.read()))


class Guard(Node):
    def __init__(self):
        super().__init__('guard')
        self.book = Logbook()
        self.tally = Tally(self)
        self.beats = self.create_publisher(Int32, 'safety/beat', 50)
        self.reports = self.create_publisher(String, 'report', 10)
        self.results = self.create_publisher(Int32, 'result', 10)
        self.beat_number = iter(range(1, 10**9))
        self.create_timer(1 / 20, self.beat, callback_group=MutuallyExclusiveCallbackGroup())
        work = MutuallyExclusiveCallbackGroup()
        self.inspections = self.create_client(
            Trigger, 'inspection', callback_group=ReentrantCallbackGroup()
        )
        self.create_subscription(String, 'inspect', self.ask, 10)
        self.create_subscription(Int32, 'scan', self.analyse, 10, callback_group=work)

    def beat(self):
        self.beats.publish(Int32(data=next(self.beat_number)))

    def ask(self, _):
        def done(future):
            answer = future.result()
            self.reports.publish(String(data=answer.message))
            self.tally.add()

        self.inspections.call_async(Trigger.Request()).add_done_callback(done)

    def analyse(self, scan):
        self.results.publish(Int32(data=analyse(self, scan.data)))
        self.tally.add()
