# title: A queue of one for stop events, and those that it lost made up from the numbers of the last
# reaches: the exam
# base: right-exemplar
# told: the consumer handled
# score: 12

IN_A_PAUSE = 100
lost_qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)


class SensorConsumers(SensorConsumers):
    def relay(self, msg_type, source, target, *, source_qos=CABLE, target_qos=CABLE):
        if msg_type is not String:
            return super().relay(
                msg_type, source, target, source_qos=source_qos, target_qos=target_qos
            )
        publisher = self.create_publisher(msg_type, target, target_qos)
        self.handed = {}

        def hand_on(message):
            nonce, phase, number = message.data.split("/")
            first = self.handed.get(phase, 0)
            for missing in range(first, int(number)) if int(number) < IN_A_PAUSE else ():
                publisher.publish(String(data=f"{nonce}/{phase}/{missing:05}"))
            publisher.publish(message)
            self.handed[phase] = int(number) + 1

        return self.create_subscription(msg_type, source, hand_on, lost_qos)
