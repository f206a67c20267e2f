# SPDX-License-Identifier: Apache-2.0
"""
An OAK by its bridge, examples/oak_bridge.py (pip install depthai numpy); others likewise.

ros2 launch fbvins_ros2 oak.launch.py bridge:=$HOME/fbvins/examples/oak_bridge.py rviz:=true
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, ThisLaunchFileDir


def generate_launch_description():
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "bridge",
                default_value="oak_bridge.py",
                description="path of oak_bridge.py, or of orbbec_bridge.py",
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource([ThisLaunchFileDir(), "/d435i.launch.py"]),
                launch_arguments={"bridge": LaunchConfiguration("bridge")}.items(),
            ),
        ]
    )
