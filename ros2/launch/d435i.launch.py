# SPDX-License-Identifier: Apache-2.0
"""
A RealSense D435i; where the program was built without librealsense: pip install pyrealsense2 numpy.

ros2 launch fbvins_ros2 d435i.launch.py camera:=d435i:848x480@60 rviz:=true
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
                default_value="d435i",
                description="d435i[:SERIAL][:WIDTHxHEIGHT[@HZ]]",
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource([ThisLaunchFileDir(), "/live.launch.py"]),
                launch_arguments={"source": LaunchConfiguration("camera")}.items(),
            ),
        ]
    )
