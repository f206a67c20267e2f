# SPDX-License-Identifier: Apache-2.0
"""ROS 2's topics and services by PyPI's `cyclonedds`, in bytes, which `rosbags` encodes: for ros2_peer.py."""
import dataclasses
import os
import struct
import time
from types import new_class

import cyclonedds._clayer as clayer  # reads and writes encoded bytes instead of values
from cyclonedds import core, pub, qos, sub, topic
from cyclonedds.idl import IdlStruct, types
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

DOMAIN = 100 + os.getpid() % 100
# As nodes of ROS 2 Iron and later are limited to their machine: on the network's interface, where there is one, without multicast.
LOOPBACK = ("<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
            "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><Peers><Peer address='localhost'/></Peers></Discovery></Domain></CycloneDDS>")
# Type of the service, and the fields of its request and its reply.
EMPTY = "uint8 structure_needs_at_least_one_member"
TRIGGER = ("std_srvs/srv/Trigger", EMPTY, "bool success\nstring message")
SERVICES = {"reset": TRIGGER, "save_map": TRIGGER, "load_map": TRIGGER, "start_record": TRIGGER, "stop_record": TRIGGER,
            "list_parameters": ("rcl_interfaces/srv/ListParameters", "string[] prefixes\nuint64 depth", "rcl_interfaces/ListParametersResult result"),
            "get_parameters": ("rcl_interfaces/srv/GetParameters", "string[] names", "rcl_interfaces/ParameterValue[] values"),
            "get_parameter_types": ("rcl_interfaces/srv/GetParameterTypes", "string[] names", "uint8[] types"),
            "describe_parameters": ("rcl_interfaces/srv/DescribeParameters", "string[] names", "rcl_interfaces/ParameterDescriptor[] descriptors"),
            "set_parameters": ("rcl_interfaces/srv/SetParameters", "rcl_interfaces/Parameter[] parameters", "rcl_interfaces/SetParametersResult[] results"),
            "set_parameters_atomically": ("rcl_interfaces/srv/SetParametersAtomically", "rcl_interfaces/Parameter[] parameters", "rcl_interfaces/SetParametersResult result"),
            "get_state": ("lifecycle_msgs/srv/GetState", EMPTY, "lifecycle_msgs/State current_state"),
            "change_state": ("lifecycle_msgs/srv/ChangeState", "lifecycle_msgs/Transition transition", "bool success"),
            "get_available_transitions": ("lifecycle_msgs/srv/GetAvailableTransitions", EMPTY, "lifecycle_msgs/TransitionDescription[] available_transitions")}
STORE = get_typestore(Stores.ROS2_JAZZY)
for _type, _request, _reply in set(SERVICES.values()):
    for _suffix, _fields in (("_Request", _request), ("_Response", _reply)):
        STORE.register({_type + _suffix: next(iter(get_types_from_msg(_fields, _type.replace("/srv/", "/msg/") + _suffix).values()))})


class Failure(Exception):
    pass


def require(fact, sentence):
    if not fact:
        raise Failure(sentence)


def wait_until(fact, what, seconds=60):
    end = time.monotonic() + seconds
    while not fact():
        require(time.monotonic() < end, f"{what} did not happen within {seconds} s")
        time.sleep(0.02)


def wire_topic(name):
    """As ROS 2's middleware names it in DDS."""
    return "rt" + name if name.startswith("/") else name


def wire_type(ros_type):
    package, kind, message = ros_type.split("/")
    return f"{package}::{kind}::dds_::{message}_"


def bytes_topic(participant, name, ros_type):
    """A topic, as DDS names it, whose values are written and read as bytes."""
    wire = wire_type(ros_type)
    kind = new_class(wire.split("::")[-1], (IdlStruct,), {"typename": wire.replace("::", ".")}, lambda space: space.update(__annotations__={"nothing": types.uint8}))
    return topic.Topic(participant, name, dataclasses.dataclass(kind))


def reliable(depth, latched=False, *more):
    durability = qos.Policy.Durability.TransientLocal if latched else qos.Policy.Durability.Volatile
    return qos.Qos(qos.Policy.Reliability.Reliable(max_blocking_time=10**9), qos.Policy.History.KeepLast(depth), durability, *more)


def taken(reader):
    """What has come, as bytes."""
    return [data for data, info in clayer.ddspy_take(reader._ref, core.SampleState.Any | core.ViewState.Any | core.InstanceState.Any, 1000) if info.valid_data]


def write(writer, data):
    require(clayer.ddspy_write(writer._ref, data.ljust((len(data) + 3) & ~3, b"\0")) >= 0, "a message could not be written")


class Client:
    """Of one of FBVINS's services, as rmw_cyclonedds_cpp is one."""

    def __init__(self, participant, name):
        self.name, (self.type, _, _) = name, SERVICES[name]
        me = qos.Policy.Userdata(f"clientid={os.getpid():x}.{len(name):x};".encode())
        self.writer = pub.DataWriter(participant, bytes_topic(participant, f"rq/fbvins/{name}Request", self.type + "_Request"), qos=reliable(10, False, me))
        self.reader = sub.DataReader(participant, bytes_topic(participant, f"rr/fbvins/{name}Reply", self.type + "_Response"), qos=reliable(10, False, me))
        self.asked = 0

    def ask(self, *fields):
        """The reply; its bytes are those that rosbags writes."""
        wait_until(lambda: self.writer.get_matched_subscriptions() and self.reader.get_matched_publications(), f"finding the service {self.name}")
        request = bytes(STORE.serialize_cdr(STORE.types[self.type + "_Request"](*fields), self.type + "_Request"))
        self.asked += 1
        header = struct.pack("<Qq", 0x1234567890abcdef, self.asked)
        write(self.writer, request[:4] + header + request[4:])
        replies = []
        wait_until(lambda: replies or replies.extend(taken(self.reader)) or replies, f"a reply of {self.name}")
        require(len(replies) == 1 and replies[0][4:20] == header, f"{self.name}: a reply with another number")
        data = replies[0][:4] + replies[0][20:]
        value = STORE.deserialize_cdr(data, self.type + "_Response")
        again = bytes(STORE.serialize_cdr(value, self.type + "_Response"))
        require(again == data[:len(again)] and not any(data[len(again):]), f"{self.name}: other bytes than rosbags writes for the same values")
        return value
