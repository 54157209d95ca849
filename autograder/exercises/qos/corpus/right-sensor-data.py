# title: Field practice: the sensor data preset, a deep queue for the stop
# fails: nothing
# in: the stub

camera_qos = qos_profile_sensor_data
lidar_qos = qos_profile_sensor_data
imu_qos = qos_profile_sensor_data
stop_qos = QoSProfile(depth=100)
