#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Evaluates packaging/70-fbvins-cameras.rules, as udev does, for descriptions of devices: cameras belong to the group that the package
makes, and nothing else does.

usage: device_rules.py REPOSITORY
"""
import fnmatch
import pathlib
import re
import sys

PACKAGING = pathlib.Path(sys.argv[1], "packaging")
TERM = re.compile(r'(?:^|, )(\w+)(\{\w+\})?(==|!=|\+=|:=|=)"([^"]*)"')
MATCHED = {"SUBSYSTEM", "ENV{DEVTYPE}", "ATTR{idVendor}", "ATTR{product}", "ATTRS{idVendor}", "ATTRS{product}"}
SET = {"GROUP=", "MODE=", "TAG+=", "RUN+="}


def rules():
    for line in (PACKAGING / "70-fbvins-cameras.rules").read_text(encoding="ascii").splitlines():
        if not line or line.startswith("#"):
            continue
        terms = [(key + (of or ""), operator, value) for key, of, operator, value in TERM.findall(line)]
        assert "".join(f', {k}{o}"{v}"' for k, o, v in terms)[2:] == line, f"not understood: {line}"
        for key, operator, _ in terms:
            assert key in MATCHED if operator == "==" else key + operator in SET, f"{key}{operator} in: {line}"
        yield terms


def given(device):
    """What the rules give a device: one of subsystem, type, attributes of its own and of one of its parents."""
    out = {}
    for terms in rules():
        def matches(key, pattern):
            own = {"SUBSYSTEM": device["subsystem"], "ENV{DEVTYPE}": device.get("type", "")}.get(key)
            if own is None:
                name = key[key.index("{") + 1:-1]
                own = (device.get("own", {}) if key.startswith("ATTR{") else {**device.get("parent", {}), **device.get("own", {})}).get(name)
            return own is not None and fnmatch.fnmatchcase(own, pattern)
        if all(matches(key, value) for key, operator, value in terms if operator == "=="):
            out.update({key: value for key, operator, value in terms if operator != "=="})
    return out


def usb(vendor, product):
    return {"subsystem": "usb", "type": "usb_device", "own": {"idVendor": vendor, "product": product}}


def main():
    group = re.search(r"groupadd --system (\w+)", (PACKAGING / "postinst").read_text(encoding="ascii"))[1]
    intel = {"idVendor": "8086", "product": "Intel(R) RealSense(TM) Depth Camera 435i "}
    cameras = [usb(*intel.values()), usb("8086", "Intel(R) RealSense(TM) Depth Camera 455"), usb("03e7", "Movidius MyriadX"),
               usb("03e7", "Luxonis Device"), usb("2bc5", "Orbbec Gemini 335"), usb("2b03", "ZED 2i"),
               {"subsystem": "hidraw", "parent": {"idVendor": "2b03"}}, {"subsystem": "iio", "parent": intel}]
    for camera in cameras:
        got = given(camera)
        assert got.get("GROUP") == group and got.get("MODE") == "0660", (camera, got)
        if camera["subsystem"] == "iio":
            assert group in got["RUN"]
    others = [usb("046d", "USB Receiver"), usb("8086", "Bluetooth"), {"subsystem": "hidraw", "parent": {"idVendor": "046d"}},
              {"subsystem": "usb", "type": "usb_interface", "parent": intel}, {"subsystem": "iio", "parent": {"idVendor": "8087"}},
              {"subsystem": "block", "parent": {"idVendor": "2bc5"}}]
    for other in others:
        assert not given(other), other
    print(f"{len(cameras)} cameras belong to {group}, {len(others)} other devices do not")
    return 0


if __name__ == "__main__":
    sys.exit(main())
