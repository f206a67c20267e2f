# SPDX-License-Identifier: Apache-2.0
"""Asks all services of a live flight, as a client of rmw_cyclonedds_cpp: for ros2_peer.py."""
import os
import threading

import numpy as np
from ros2_dds import SERVICES, STORE, Client, require, wait_until


class Questions(threading.Thread):
    """Asks all services while the flight goes on."""

    def __init__(self, participant, folder):
        super().__init__(daemon=True)
        self.clients = {name: Client(participant, name) for name in SERVICES}
        self.folder, self.problem = folder, "the services were not asked"

    def run(self):
        try:
            self.ask_all()
            self.problem = ""
        except Exception as error:  # said by the main thread
            self.problem = f"{type(error).__name__}: {error}"

    def trigger(self, name):
        reply = self.clients[name].ask(0)
        return reply.success, reply.message

    def ask_all(self):
        ask = {name: client.ask for name, client in self.clients.items()}
        wait_until(lambda: ask["get_state"](0).current_state.label == "active", "a pose")
        record = str(self.folder / "record.mcap")
        require(self.trigger("stop_record") == (False, "no record is being written"), "stop_record before there is one")
        require(self.trigger("start_record") == (True, "recording " + record), "start_record")
        map_file = str(self.folder / "flat.fbm")
        require(self.trigger("save_map") == (True, "the map is saved in " + map_file), "save_map")
        require(os.path.getsize(map_file) > 1000, "the saved map")
        names = ask["list_parameters"]([], 0).result.names
        require({"estimator.max_iterations", "frontend.kind", "live.ros2.clock"} <= set(names), f"parameters: {names}")
        require(ask["list_parameters"](["live.ros2"], 1).result.names == [n for n in names if n.startswith("live.ros2.")], "parameters below a prefix")
        values = dict(zip(names, ask["get_parameters"](names).values))
        some = (values["frontend.kind"].string_value, values["live.smoothing_s"].double_value, values["estimator.estimate_extrinsics"].bool_value, values["loop.max_keyframes"].type)
        require(some == ("boost", 0.1, False, 2), f"values of parameters: {some}")
        require([v.type for v in values.values()] == list(ask["get_parameter_types"](names).types), "types of parameters")
        described = dict(zip(names, ask["describe_parameters"](names).descriptors))
        require(all(d.name == n and d.read_only and d.type == values[n].type for n, d in described.items()), "descriptions of parameters")
        require(described["live.smoothing_s"].floating_point_range[0].to_value == 2.0, "the range of a parameter")
        types_of = STORE.types
        value = types_of["rcl_interfaces/msg/ParameterValue"](3, False, 0, 1.0, "", np.zeros(0, np.uint8), np.zeros(0, bool), np.zeros(0, np.int64), np.zeros(0), [])
        wish = [types_of["rcl_interfaces/msg/Parameter"]("live.smoothing_s", value)]
        refused = [*ask["set_parameters"](wish).results, ask["set_parameters_atomically"](wish).result]
        require(all(not r.successful and "--set live.smoothing_s=VALUE" in r.reason for r in refused), f"set_parameters: {refused}")
        require(not ask["change_state"](types_of["lifecycle_msgs/msg/Transition"](4, "deactivate")).success, "change_state")
        require(list(ask["get_available_transitions"](0).available_transitions) == [], "transitions")
        require(self.trigger("stop_record") == (True, "the record is " + record), "stop_record")
        loaded, said = self.trigger("load_map")
        require(loaded and said.endswith(f"keyframes of {map_file}; what this flight added since that was saved is forgotten"), f"load_map: {said}")
        require(self.trigger("reset") == (True, "the estimator starts again with the next image"), "reset")
