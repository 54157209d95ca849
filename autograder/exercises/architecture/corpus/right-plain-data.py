# title: Plain data, and types by name
# fails: nothing

design = course.Design.from_data(
    {
        "lidar": {"publishes": [["scan", "sensor_msgs/msg/LaserScan", qos_profile_sensor_data]]},
        "camera": {"publishes": [["camera/image", "sensor_msgs/msg/Image", 1]]},
        "encoders": {"publishes": [["wheel/odometry", "nav_msgs/msg/Odometry"]]},
        "maps": {"publishes": [["map", "nav_msgs/msg/OccupancyGrid"]]},
        "localization": {
            "subscribes": [
                ["wheel/odometry", "nav_msgs/msg/Odometry"],
                ["map", "nav_msgs/msg/OccupancyGrid"],
            ],
            "publishes": [["odometry/filtered", "nav_msgs/msg/Odometry"]],
        },
        "detection": {
            "subscribes": [
                ["scan", "sensor_msgs/msg/LaserScan", qos_profile_sensor_data],
                ["camera/image", "sensor_msgs/msg/Image", 1],
            ],
            "publishes": [["obstacle/distance", "std_msgs/msg/Float32"]],
        },
        "planning": {
            "subscribes": [["map", "nav_msgs/msg/OccupancyGrid"]],
            "serves": [["make_plan", "nav_msgs/srv/GetPlan"]],
        },
        "pilot": {
            "action_server": [["navigate_to", NavigateTo]],
            "subscribes": [["odometry/filtered", "nav_msgs/msg/Odometry"]],
            "calls": [["make_plan", "nav_msgs/srv/GetPlan"]],
            "publishes": [["plan", "nav_msgs/msg/Path"]],
        },
        "driving": {
            "subscribes": [
                ["plan", "nav_msgs/msg/Path"],
                ["obstacle/distance", "std_msgs/msg/Float32"],
            ],
            "publishes": [["motors/command", "geometry_msgs/msg/Twist"]],
        },
    },
    outside=["motors/command", "navigate_to"],
)
