# SPDX-License-Identifier: Apache-2.0
"""
An OAK (pip install depthai numpy), or an Orbbec camera (pip install pyorbbecsdk2 numpy).

ros2 launch fbvins_ros2 oak.launch.py rviz:=true
ros2 launch fbvins_ros2 oak.launch.py camera:=orbbec
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, ThisLaunchFileDir


def generate_launch_description():
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "camera",
                default_value="oak",
                description="oak[:DEVICE][:@HZ], or orbbec[:SERIAL][:WIDTHxHEIGHT[@HZ]]",
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource([ThisLaunchFileDir(), "/live.launch.py"]),
                launch_arguments={"source": LaunchConfiguration("camera")}.items(),
            ),
        ]
    )
