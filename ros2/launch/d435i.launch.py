# SPDX-License-Identifier: Apache-2.0
"""
A RealSense D435i, by the program's own driver or by a bridge.

Where the program was built without librealsense, `bridge` starts examples/d435i_bridge.py
(pip install pyrealsense2 numpy).

ros2 launch fbvins_ros2 d435i.launch.py bridge:=$HOME/fbvins/examples/d435i_bridge.py rviz:=true
"""

from launch import LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    IncludeLaunchDescription,
    OpaqueFunction,
)
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, ThisLaunchFileDir


def camera(context):
    bridge = LaunchConfiguration("bridge").perform(context)
    socket = LaunchConfiguration("socket").perform(context)
    actions = [ExecuteProcess(cmd=["python3", bridge, socket], output="screen")] if bridge else []
    source = "socket:" + socket if bridge else "d435i"
    return [
        *actions,
        IncludeLaunchDescription(
            PythonLaunchDescriptionSource([ThisLaunchFileDir(), "/live.launch.py"]),
            launch_arguments={"source": source}.items(),
        ),
    ]


def generate_launch_description():
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "bridge",
                default_value="",
                description="path of d435i_bridge.py; empty: the program's own driver",
            ),
            DeclareLaunchArgument(
                "socket",
                default_value="/tmp/fbvins.sock",
                description="between the bridge and fbvins",
            ),
            OpaqueFunction(function=camera),
        ]
    )
