# SPDX-License-Identifier: Apache-2.0
r"""
`fbvins live` with its topics in this domain, and RViz if wanted.

ros2 launch fbvins_ros2 live.launch.py source:=socket:/run/fbvins/sensors.sock \
    arguments:="--map flat.fbm" rviz:=true
"""

import shlex

from launch import LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    OpaqueFunction,
    SetEnvironmentVariable,
    Shutdown,
)
from launch.conditions import IfCondition
from launch.substitutions import EnvironmentVariable, LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

ARGUMENTS = (
    ("source", "socket:/run/fbvins/sensors.sock", "as of fbvins live --source"),
    ("program", "fbvins", "the program, where it is not on the PATH"),
    ("domain", EnvironmentVariable("ROS_DOMAIN_ID", default_value="0"), "ROS_DOMAIN_ID"),
    (
        "interface",
        "",
        "of the network; empty: this machine alone, for the nodes started here as well",
    ),
    ("node", "fbvins", "name of the node; with a namespace as in /drone1/fbvins"),
    ("config", "", "a configuration file"),
    ("calibration", "", "Kalibr's camchain-imucam.yaml instead of the source's own"),
    ("imu_calibration", "", "Kalibr's imu.yaml, with calibration"),
    ("arguments", "", "further arguments of fbvins live, in one text"),
    ("rviz", "false", "start RViz as well"),
)


def live(context):
    def value(name):
        return LaunchConfiguration(name).perform(context)

    command = [value("program"), "live", "--source", value("source")]
    command += [
        "--ros2",
        value("domain") + (":" + value("interface") if value("interface") else ""),
        "--set",
        "live.ros2.node=" + value("node"),
    ]
    for name in ("config", "calibration", "imu_calibration"):
        if value(name):
            command += ["--" + name.replace("_", "-"), value(name)]
    command += shlex.split(value("arguments"))
    actions = [
        ExecuteProcess(
            cmd=command, output="screen", on_exit=Shutdown(reason="fbvins live has ended")
        )
    ]
    if not value("interface"):  # its peers look on the loopback, too
        actions = [
            SetEnvironmentVariable("ROS_LOCALHOST_ONLY", "1"),
            SetEnvironmentVariable("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),
            *actions,
        ]
    return actions


def generate_launch_description():
    display = PathJoinSubstitution([FindPackageShare("fbvins_ros2"), "rviz", "fbvins.rviz"])
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=default, description=text)
                for name, default, text in ARGUMENTS
            ),
            OpaqueFunction(function=live),
            Node(
                package="rviz2",
                executable="rviz2",
                arguments=["-d", display],
                condition=IfCondition(LaunchConfiguration("rviz")),
            ),
        ]
    )
