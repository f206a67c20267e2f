# SPDX-License-Identifier: Apache-2.0
r"""
FB-VINS as a component, in a container of its own or in that of a driver.

A driver's images then come without a copy.

ros2 launch fbvins_ros2 component.launch.py \
    calibration:=camchain-imucam.yaml imu_calibration:=imu.yaml
ros2 launch fbvins_ros2 component.launch.py container:=/camera/camera_container \
    calibration:=camchain-imucam.yaml imu_calibration:=imu.yaml
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import ComposableNodeContainer, LoadComposableNodes
from launch_ros.descriptions import ComposableNode

ARGUMENTS = (
    ("left", "/camera/camera/infra1/image_rect_raw", "sensor_msgs/Image of the left camera"),
    (
        "right",
        "/camera/camera/infra2/image_rect_raw",
        "sensor_msgs/Image of the right camera; empty: there is one camera",
    ),
    ("imu", "/camera/camera/imu", "sensor_msgs/Imu"),
    ("calibration", "", "Kalibr's camchain-imucam.yaml"),
    ("imu_calibration", "", "Kalibr's imu.yaml"),
    ("config", "", "configuration (YAML)"),
    ("container", "", "a running container to load it into; empty: one of its own"),
)


def component(context):
    def value(name):
        return LaunchConfiguration(name).perform(context)

    images = [value(name) for name in ("left", "right") if value(name)]
    parameters = {
        "images": images,
        **{name: value(name) for name in ("imu", "calibration", "imu_calibration", "config")},
    }
    node = ComposableNode(
        package="fbvins_ros2",
        plugin="fbvins_ros2::FbvinsComponent",
        name="fbvins",
        parameters=[parameters],
        extra_arguments=[{"use_intra_process_comms": True}],
    )
    if value("container"):
        return [
            LoadComposableNodes(
                target_container=value("container"), composable_node_descriptions=[node]
            )
        ]
    return [
        ComposableNodeContainer(
            name="fbvins_container",
            namespace="",
            package="rclcpp_components",
            executable="component_container_mt",
            composable_node_descriptions=[node],
            output="screen",
        )
    ]


def generate_launch_description():
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=default, description=text)
                for name, default, text in ARGUMENTS
            ),
            OpaqueFunction(function=component),
        ]
    )
