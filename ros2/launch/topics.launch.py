# SPDX-License-Identifier: Apache-2.0
r"""
Images and readings from topics, of a driver that runs elsewhere or of a bag played here.

ros2 launch fbvins_ros2 topics.launch.py \
    left:=/oak/left/image_raw right:=/oak/right/image_raw imu:=/oak/imu/data \
    calibration:=camchain-imucam.yaml imu_calibration:=imu.yaml
ros2 launch fbvins_ros2 topics.launch.py bag:=flight \
    left:=/cam0/image_raw right:=/cam1/image_raw imu:=/imu0 \
    calibration:=camchain-imucam.yaml imu_calibration:=imu.yaml
"""

from launch import LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    IncludeLaunchDescription,
    OpaqueFunction,
    TimerAction,
)
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, ThisLaunchFileDir

ARGUMENTS = (
    ("left", "/camera/camera/infra1/image_rect_raw", "sensor_msgs/Image of the left camera"),
    ("right", "/camera/camera/infra2/image_rect_raw", "sensor_msgs/Image of the right camera"),
    ("imu", "/camera/camera/imu", "sensor_msgs/Imu"),
    ("bag", "", "a bag to play; its topics are those above"),
)
FIND_EACH_OTHER_S = 3.0  # before the bag plays


def topics(context):
    def value(name):
        return LaunchConfiguration(name).perform(context)

    source = "ros2:" + ",".join(value(name) for name in ("left", "right", "imu"))
    actions = [
        IncludeLaunchDescription(
            PythonLaunchDescriptionSource([ThisLaunchFileDir(), "/live.launch.py"]),
            launch_arguments={"source": source}.items(),
        )
    ]
    if value("bag"):
        player = ExecuteProcess(cmd=["ros2", "bag", "play", value("bag")], output="screen")
        actions.append(TimerAction(period=FIND_EACH_OTHER_S, actions=[player]))
    return actions


def generate_launch_description():
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=default, description=text)
                for name, default, text in ARGUMENTS
            ),
            OpaqueFunction(function=topics),
        ]
    )
