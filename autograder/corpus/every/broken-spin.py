# title: rclpy.spin in a cell
# fails: everything
# seconds: 8

import rclpy

if not rclpy.ok():
    rclpy.init()
rclpy.spin(rclpy.create_node("in_the_way"))
