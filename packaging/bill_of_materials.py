#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The software bill of materials of a release, as SPDX 2.3 in JSON (sbom.spdx.json).

  packaging/bill_of_materials.py PACKAGE.deb... > sbom.spdx.json

Of each package: its checksum, the libraries that it loads (its dependencies, with the least version), and the libraries whose
code is inside, as packaging/copyright has them, with the versions of this machine, of the libraries fetched for arm64, and of
web/package-lock.json.
"""
import datetime
import gzip
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import uuid

REPOSITORY = pathlib.Path(__file__).resolve().parents[1]
ARM64 = REPOSITORY / "build-sysroot/arm64"  # packaging/arm64_sysroot: only extracted, so that dpkg does not know its packages
# Whose code is compiled in: name as in packaging/copyright's Comment, the package or module that has it.
DEBIAN = {"Eigen": "libeigen3-dev", "fmt": "libfmt-dev", "JSON for Modern C++": "nlohmann-json3-dev", "yaml-cpp": "libyaml-cpp-dev", "CLI11": "libcli11-dev",
          "Ceres Solver": "libceres-dev", "Boost.Beast": "libboost-dev", "SIMDe": "libsimde-dev"}
NPM = {"three.js": "three", "uPlot": "uplot"}
PYTHON_ONLY = {"nanobind", "robin-map"}
SPDX_NAMES = {"Expat": "MIT"}


def control(package, field):
    return subprocess.run(["dpkg-deb", "--field", package, field], capture_output=True, text=True, check=True).stdout.strip()


def debian_version(package):
    found = subprocess.run(["dpkg-query", "-W", "-f=${Version}", package], capture_output=True, text=True, check=False)
    if found.stdout.strip():
        return found.stdout.strip()
    changelog = ARM64 / "usr/share/doc" / package / "changelog.Debian.gz"
    if not changelog.exists():
        return "NOASSERTION"
    with gzip.open(changelog, "rt", encoding="utf-8") as text:
        return re.match(r"\S+ \((\S+)\)", text.readline())[1]


def inside():
    """(name, license, version, where) of each library whose code is in the packages."""
    npm = json.loads((REPOSITORY / "web/package-lock.json").read_text(encoding="utf-8"))["packages"]
    for stanza in (REPOSITORY / "packaging/copyright").read_text(encoding="utf-8").split("\n\n"):
        fields = dict(re.findall(r"^(\w+): (.*)$", stanza, re.MULTILINE))
        if "Files" not in fields or fields["Files"] == "*":
            continue
        name = fields["Comment"].split(",")[0]
        if name in PYTHON_ONLY or fields["Comment"].startswith(tuple(PYTHON_ONLY)):
            continue
        license_name = SPDX_NAMES.get(fields["License"], fields["License"])
        if name in NPM:
            yield name, license_name, npm[f"node_modules/{NPM[name]}"]["version"], f"pkg:npm/{NPM[name]}"
        elif name in DEBIAN:
            yield name, license_name, debian_version(DEBIAN[name]), f"pkg:deb/debian/{DEBIAN[name]}"
        else:
            raise SystemExit(f"packaging/copyright: {name} is in no table of {pathlib.Path(__file__).name}")


def spdx_id(text):
    return "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", text)


def entry(name, version, license_name, locator=None):
    out = {"SPDXID": spdx_id(f"{name}-{version}"), "name": name, "versionInfo": version, "downloadLocation": "NOASSERTION",
           "filesAnalyzed": False, "licenseConcluded": license_name, "licenseDeclared": license_name, "copyrightText": "NOASSERTION"}
    if locator:
        out["externalRefs"] = [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": locator}]
    return out


def bill(files):
    packages, relations = {}, []

    def add(package):
        packages[package["SPDXID"]] = package
        return package["SPDXID"]

    def relate(a, kind, b):
        relations.append({"spdxElementId": a, "relationshipType": kind, "relatedSpdxElement": b})

    compiled_in = [add(entry(name, version, license_name, f"{where}@{version}")) for name, license_name, version, where in inside()]
    for file in files:
        name, version, architecture = (control(file, field) for field in ("Package", "Version", "Architecture"))
        ours = entry(f"{name}_{architecture}", version, "Apache-2.0")
        ours["packageFileName"] = pathlib.Path(file).name
        ours["checksums"] = [{"algorithm": "SHA256", "checksumValue": hashlib.sha256(pathlib.Path(file).read_bytes()).hexdigest()}]
        own = add(ours)
        relate("SPDXRef-DOCUMENT", "DESCRIBES", own)
        for library in compiled_in:
            if packages[library]["name"] != "SIMDe" or architecture == "arm64":
                relate(own, "CONTAINS", library)
        for dependency in filter(None, (d.strip() for d in control(file, "Depends").split(","))):
            match = re.match(r"(\S+)(?: \(([<>=]+) ([^)]+)\))?", dependency)
            least = match[3] or "NOASSERTION"
            relate(own, "DEPENDS_ON", add(entry(match[1], least, "NOASSERTION", f"pkg:deb/debian/{match[1]}")))
    created = datetime.datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", datetime.datetime.now().timestamp())), datetime.timezone.utc)
    identity = hashlib.sha256("".join(sorted(packages)).encode() + "".join(str(p.get("checksums")) for p in packages.values()).encode()).hexdigest()
    return {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": "fbvins",
            "documentNamespace": f"https://spdx.org/spdxdocs/fbvins-{uuid.uuid5(uuid.NAMESPACE_OID, identity)}",
            "creationInfo": {"created": created.strftime("%Y-%m-%dT%H:%M:%SZ"), "creators": ["Organization: FB-VINS developers", "Tool: bill_of_materials.py"]},
            "packages": list(packages.values()), "relationships": relations}


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    json.dump(bill(sys.argv[1:]), sys.stdout, indent=1)
    print()
