# SPDX-License-Identifier: Apache-2.0
"""ROS 2's topics by PyPI's `cyclonedds`, in bytes, which `rosbags` encodes: for ros2_peer.py."""
import dataclasses
import os
import time
from types import new_class

import cyclonedds._clayer as clayer  # reads and writes encoded bytes instead of values
from cyclonedds import core, pub, qos, sub, topic
from cyclonedds.idl import IdlStruct, types
from rosbags.typesys import Stores, get_typestore

DOMAIN = 100 + os.getpid() % 100
# As nodes of ROS 2 Iron and later are limited to their machine: on the network's interface, where there is one, without multicast.
LOOPBACK = ("<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
            "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><Peers><Peer address='localhost'/></Peers></Discovery></Domain></CycloneDDS>")
STORE = get_typestore(Stores.ROS2_JAZZY)


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
