#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The colcon package in ros2/ without ROS: package.xml by its schema (PyPI's `catkin_pkg`, if it is there), launch files run with stand-ins for
ROS's `launch`, and what they start is what `fbvins live` takes; displays show topics that are published (the table of docs/ros2.md).

usage: ros2_package.py FBVINS REPOSITORY [PYTHON]      PYTHON: an interpreter that may have PyYAML and catkin_pkg (./dev test makes one)
exit 77 (skipped) where PyYAML is not installed
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import types
import xml.etree.ElementTree as ElementTree

try:
    from ruamel.yaml import YAML
except ImportError as missing:
    if len(sys.argv) > 3 and pathlib.Path(sys.argv[3]).exists():
        os.execv(sys.argv[3], [sys.argv[3], __file__, *sys.argv[1:3]])
    print(f"skipped: ruamel.yaml is not installed ({missing}); ./dev test installs it where PyPI can be reached")
    sys.exit(77)


def require(fact, sentence):
    if not fact:
        raise SystemExit(f"FAIL: {sentence}")


class StandIn:
    """Of any class of `launch`: keeps what it was made of."""

    def __init__(self, *values, **named):
        self.values, self.named = values, named


def substituted(value, given):
    """The text that a substitution becomes."""
    if isinstance(value, str):
        return value
    if isinstance(value, (list, tuple)):
        return "".join(substituted(v, given) for v in value)
    return {"LaunchConfiguration": lambda: given[value.values[0]], "EnvironmentVariable": lambda: value.named["default_value"], "ThisLaunchFileDir": lambda: ".",
            "FindPackageShare": lambda: ".", "PathJoinSubstitution": lambda: "/".join(substituted(v, given) for v in value.values[0])}[type(value).__name__]()


def stand_ins():
    """ROS's modules, as far as the launch files import them."""
    classes = {"launch": ["LaunchDescription"],
               "launch.actions": ["DeclareLaunchArgument", "ExecuteProcess", "IncludeLaunchDescription", "OpaqueFunction", "SetEnvironmentVariable", "Shutdown", "TimerAction"],
               "launch.conditions": ["IfCondition"], "launch.launch_description_sources": ["PythonLaunchDescriptionSource"],
               "launch.substitutions": ["EnvironmentVariable", "LaunchConfiguration", "PathJoinSubstitution", "ThisLaunchFileDir"],
               "launch_ros": [], "launch_ros.actions": ["ComposableNodeContainer", "LoadComposableNodes", "Node"], "launch_ros.descriptions": ["ComposableNode"], "launch_ros.substitutions": ["FindPackageShare"]}
    for module, names in classes.items():
        sys.modules[module] = types.ModuleType(module)
        for name in names:
            body = {"perform": lambda self, given: substituted(self, given)} if name == "LaunchConfiguration" else {}
            setattr(sys.modules[module], name, type(name, (StandIn,), body))


def processes(folder, name, given):
    """The command lines that a launch file starts, and those that it includes."""
    space = {}
    exec(compile((folder / name).read_text(encoding="utf-8"), name, "exec"), space)  # our own file
    todo, commands, declared = list(space["generate_launch_description"]().values[0]), [], set()
    given = dict(given)
    while todo:
        action = todo.pop(0)
        kind = type(action).__name__
        if kind == "DeclareLaunchArgument":
            require(action.named["description"], f"{name}: {action.values[0]} has no description")
            declared.add(action.values[0])
            given.setdefault(action.values[0], substituted(action.named["default_value"], given))
        elif kind == "OpaqueFunction":
            todo[:0] = action.named["function"](given)
        elif kind == "TimerAction":
            todo[:0] = action.named["actions"]
        elif kind == "ExecuteProcess":
            commands.append([substituted(part, given) for part in action.named["cmd"]])
        elif kind == "IncludeLaunchDescription":
            other = substituted(action.values[0].values[0], given).lstrip("./")
            passed = {key: substituted(value, given) for key, value in action.named["launch_arguments"]}
            more, known = processes(folder, other, {**given, **passed})
            commands += more
            require(set(passed) <= known, f"{name}: {other} has no argument {set(passed) - known}")
            declared |= known
        elif kind in ("ComposableNodeContainer", "LoadComposableNodes"):
            commands.append(action.named)
        else:
            require(kind in ("SetEnvironmentVariable", "Node"), f"{name}: {kind}")
    return commands, declared


def check_launch_files(root, program):
    stand_ins()
    folder = root / "ros2/launch"
    help_text = subprocess.run([program, "live", "--help"], check=True, capture_output=True, text=True, timeout=60).stdout
    options = set(re.findall(r"--[a-z0-9-]+", help_text))
    full = {"config": "a.yaml", "calibration": "chain.yaml", "imu_calibration": "imu.yaml", "interface": "eth0", "arguments": "--map 'flat one.fbm' --quiet"}
    expected = {("live.launch.py", ""): ["socket:/run/fbvins/sensors.sock"], ("d435i.launch.py", ""): ["d435i"], ("oak.launch.py", ""): ["oak"],
                ("topics.launch.py", ""): ["ros2:/camera/camera/infra1/image_rect_raw,/camera/camera/infra2/image_rect_raw,/camera/camera/imu"],
                ("topics.launch.py", "bag"): ["ros2:/camera/camera/infra1/image_rect_raw,/camera/camera/infra2/image_rect_raw,/camera/camera/imu"]}
    require({name for name, _ in expected} | {"component.launch.py"} == {f.name for f in folder.glob("*")}, "a launch file that this test does not know")
    for (name, more), sources in expected.items():
        for given in ({}, full):
            commands, declared = processes(folder, name, {**given, **({more: "x.py"} if more else {})})
            require(set(given) <= declared, f"{name} has no argument {set(given) - declared}")
            live = [c for c in commands if c[:2] == ["fbvins", "live"]]
            require([c[c.index("--source") + 1] for c in live] == sources, f"{name}: {commands}")
            require(len(commands) == (2 if more else 1), f"{name} {more}: {commands}")
            unknown = {part for part in live[0] if part.startswith("--")} - options
            require(not unknown, f"{name}: fbvins live has no {unknown}")
            address = live[0][live[0].index("--ros2") + 1]
            require(address == ("0:eth0" if given else "0"), f"{name}: {address}")
            require(not given or live[0][-3:] == ["--map", "flat one.fbm", "--quiet"], f"{name}: {live[0]}")


def check_component(root):
    """What the launch file gives the component is what its source declares, and what it is built with is in package.xml."""
    source = (root / "ros2/src/fbvins_component.cpp").read_text(encoding="utf-8")
    known = set(re.findall(r'declare_parameter<[^(]*>\(\s*"(\w+)"', source))
    require(len(known) == 7, f"parameters of the component: {known}")
    for given, where, images in (({}, "name", 2), ({"container": "/camera/container", "right": ""}, "target_container", 1)):
        loaded, = processes(root / "ros2/launch", "component.launch.py", {"calibration": "chain.yaml", **given})[0]
        node, = loaded["composable_node_descriptions"]
        parameters, = node.named["parameters"]
        require(where in loaded and len(parameters["images"]) == images and parameters["calibration"] == "chain.yaml", f"component.launch.py: {parameters}")
        require(set(parameters) <= known, f"component.launch.py: the component has no parameter {set(parameters) - known}")
        require(node.named["extra_arguments"] == [{"use_intra_process_comms": True}], "images without a copy")
        require(f"RCLCPP_COMPONENTS_REGISTER_NODE({node.named['plugin']})" in source, f"component.launch.py: {node.named['plugin']}")
    build = (root / "ros2/CMakeLists.txt").read_text(encoding="utf-8")
    used = {"rclcpp", "rclcpp_components", *re.search(r"set\(messages ([a-z0-9_ ]+)\)", build)[1].split()}
    depends = {d.text for d in ElementTree.parse(root / "ros2/package.xml").getroot().findall("depend")}
    require(used == depends, f"package.xml and CMakeLists.txt differ in {used ^ depends}")
    included = set(re.findall(r"#include <(\w+)/(?:msg|srv)/", source)) - {"fbvins"}
    require(included <= depends, f"package.xml lacks {included - depends}")


def check_package(root):
    text = (root / "ros2/package.xml").read_text(encoding="utf-8")
    package = ElementTree.fromstring(text)
    version = re.search(r"project\(fbvins VERSION ([0-9.]+)", (root / "CMakeLists.txt").read_text(encoding="utf-8"))[1]
    require(package.get("format") == "3" and package.findtext("name") == "fbvins_ros2", "package.xml: format and name")
    require(package.findtext("version") == version, f"package.xml has version {package.findtext('version')}, FBVINS {version}")
    build = (root / "ros2/CMakeLists.txt").read_text(encoding="utf-8")
    require(f"project({package.findtext('name')} " in build, "CMakeLists.txt: the package's name")
    require("set(CMAKE_BUILD_TYPE Release)" in build, "CMakeLists.txt: without a build type colcon compiles Eigen's templates, which the libraries share, without optimisation")
    first = json.loads((root / "ros2/colcon.pkg").read_text(encoding="utf-8"))["build-dependencies"]
    require(first == [re.search(r"^project\((\w+) ", (root / "CMakeLists.txt").read_text(encoding="utf-8"), re.MULTILINE)[1]], f"colcon.pkg: {first}, and not what colcon finds at the repository's root")
    for folder in re.search(r"install\(DIRECTORY ([a-z ]+) DESTINATION", build)[1].split():
        require(any((root / "ros2" / folder).iterdir()), f"ros2/{folder} is empty")
    try:
        from catkin_pkg.package import parse_package_string
    except ImportError:
        return "not by catkin_pkg, which is not installed"
    warnings = []
    parse_package_string(text, warnings=warnings)
    require(not warnings, f"package.xml: {warnings}")
    return "by catkin_pkg"


def topics_in(value):
    """All texts of a tree that are names of topics, without fields of their messages."""
    if isinstance(value, dict):
        return set().union(*(topics_in(v) for pair in value.items() for v in pair)) if value else set()
    if isinstance(value, list):
        return set().union(*map(topics_in, value)) if value else set()
    return {value.split(".")[0]} if isinstance(value, str) and value.startswith("/") else set()


def check_displays(root):
    documented = set(re.findall(r"`(/[a-z0-9_/]+)`", (root / "docs/ros2.md").read_text(encoding="utf-8")))
    rviz = YAML(typ="safe").load((root / "ros2/rviz/fbvins.rviz").read_text(encoding="utf-8"))
    layout = json.loads((root / "ros2/foxglove/fbvins.json").read_text(encoding="utf-8"))
    for name, tree in (("fbvins.rviz", rviz), ("fbvins.json", layout)):
        shown = topics_in(tree)
        require(len(shown) >= 4 and shown <= documented, f"{name} shows {shown - documented}, which docs/ros2.md does not list")

    analyzer = YAML(typ="safe").load((root / "ros2/config/diagnostics.yaml").read_text(encoding="utf-8"))["/**"]["ros__parameters"]["fbvins"]
    sink = (root / "src/fbvins/ros2/ros2_sink.cpp").read_text(encoding="utf-8")
    require(re.search(r'diagnostic.name = "([a-z]+): "', sink)[1] == analyzer["startswith"][0], "diagnostics.yaml: the name of the diagnostics")

    def panels(node):
        return {node} if isinstance(node, str) else panels(node["first"]) | panels(node["second"])
    require(panels(layout["layout"]) == set(layout["configById"]), "fbvins.json: panels and their settings")
    missing = {"globalVariables", "playbackConfig", "userNodes"} - set(layout)
    require(not missing and layout["playbackConfig"]["speed"] == 1, f"fbvins.json lacks {missing}, without which a recording cannot be played")


def main():
    program, root = sys.argv[1], pathlib.Path(sys.argv[2])
    how = check_package(root)
    check_launch_files(root, program)
    check_component(root)
    check_displays(root)
    print(f"package.xml read ({how}); launch files and displays are consistent with fbvins live")


if __name__ == "__main__":
    main()
