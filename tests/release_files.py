#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What `./dev release` refuses before it builds; packaging/site/versions.py, and packaging/apt_repository and packaging/bill_of_materials.py on two small packages: apt itself takes what is in the repository, and
nothing that was altered; PyPI's spdx-tools reads the bill, where they are installed.

usage: release_files.py [PYTHON]     exit 77 (skipped) without GnuPG, apt-utils or dpkg-dev
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

REPOSITORY = pathlib.Path(__file__).resolve().parents[1]
for tool in ("gpg", "apt-get", "apt-ftparchive", "dpkg-scanpackages", "dpkg-deb"):
    if shutil.which(tool) is None:
        print(f"skipped: {tool} is not installed")
        sys.exit(77)


def require(fact, sentence):
    if not fact:
        sys.exit(f"FAIL: {sentence}")


def run(*command, ok=True, **more):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=120, check=False, **more)
    require((done.returncode == 0) == ok, f"{command[0]}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done


def package(folder, architecture):
    root = folder / f"fbvins-{architecture}"
    (root / "DEBIAN").mkdir(parents=True)
    (root / "DEBIAN/control").write_text(f"Package: fbvins\nVersion: 9.8.7-1\nArchitecture: {architecture}\nMaintainer: nobody <nobody@localhost>\n"
                                         "Depends: libc6 (>= 2.34), libfmt9\nDescription: test\n")
    (root / "usr").mkdir()
    (root / "usr/what").write_text(architecture)
    run("dpkg-deb", "--build", "--root-owner-group", root, folder)
    return folder / f"fbvins_9.8.7-1_{architecture}.deb"


def apt(folder, repository, keyring, *arguments, ok=True):
    """apt-get with lists, cache and sources of its own."""
    state = folder / "apt"
    if "update" in arguments:
        shutil.rmtree(state, ignore_errors=True)  # what was fetched before is not fetched again
    for part in ("lists/partial", "cache/archives/partial", "etc"):
        (state / part).mkdir(parents=True, exist_ok=True)
    (state / "status").touch()
    (state / "sources.list").write_text(f"deb [signed-by={keyring}] file:{repository} stable main\n")
    options = {"Dir::State::Lists": state / "lists", "Dir::State::status": state / "status", "Dir::Cache": state / "cache", "Dir::Etc::SourceList": state / "sources.list",
               "Dir::Etc::SourceParts": "-", "Dir::Etc::main": "-", "Dir::Etc::parts": state / "etc", "APT::Architecture": "amd64", "APT::Architectures": "amd64,arm64",
               "APT::Sandbox::User": "root", "APT::Get::List-Cleanup": "1"}
    return run("apt-get", *(f"-o{name}={value}" for name, value in options.items()), *arguments, ok=ok, cwd=folder)


def check_repository(folder, packages):
    home = folder / "gnupg"
    home.mkdir(mode=0o700)
    os.environ["GNUPGHOME"] = str(home)
    run("gpg", "--batch", "--passphrase", "", "--quick-generate-key", "release@localhost", "ed25519", "sign", "never")
    repository, script = folder / "repository", REPOSITORY / "packaging/apt_repository"
    done = run(script, repository, *packages, ok=False)
    require(done.returncode == 2 and "FBVINS_RELEASE_KEY is not set" in done.stderr, "a repository without a key")
    os.environ["FBVINS_RELEASE_KEY"] = "nobody@localhost"
    require("no such secret key" in run(script, repository, *packages, ok=False).stderr, "a repository with a key that is not there")
    os.environ["FBVINS_RELEASE_KEY"] = "release@localhost"
    require("not a Debian package" in run(script, repository, __file__, ok=False).stderr, "a repository of this file")
    run(script, repository, *packages)
    keyring = repository / "fbvins-archive-keyring.asc"
    apt(folder, repository, keyring, "update")
    for architecture in ("amd64", "arm64"):
        apt(folder, repository, keyring, "download", f"fbvins:{architecture}")
        require((folder / packages[architecture == "arm64"].name).exists(), f"the package of {architecture}")
    index = repository / "dists/stable/main/binary-amd64/Packages"
    for file in (index, index.with_suffix(".xz")):
        file.unlink()
    index.write_text("Package: fbvins\nVersion: 9.9-1\nArchitecture: amd64\nFilename: pool/evil.deb\nSize: 1\n")
    apt(folder, repository, keyring, "update", ok=False)
    run("gpg", "--batch", "--passphrase", "", "--quick-generate-key", "other@localhost", "ed25519", "sign", "never")
    other = folder / "other.asc"
    other.write_text(run("gpg", "--batch", "--armor", "--export", "other@localhost").stdout)
    run(script, repository, *packages)
    apt(folder, repository, other, "update", ok=False)


def check_bill(folder, packages):
    bill = json.loads(run(REPOSITORY / "packaging/bill_of_materials.py", *packages).stdout)
    by_id = {p["SPDXID"]: p for p in bill["packages"]}
    require(len(by_id) == len(bill["packages"]), "two entries of one name")

    def related(own, kind):
        return {by_id[r["relatedSpdxElement"]]["name"] for r in bill["relationships"] if r["relationshipType"] == kind and r["spdxElementId"] == own}

    described = {by_id[r["relatedSpdxElement"]]["name"]: r["relatedSpdxElement"] for r in bill["relationships"] if r["relationshipType"] == "DESCRIBES"}
    require(sorted(described) == ["fbvins_amd64", "fbvins_arm64"], f"the bill describes {sorted(described)}")
    for name, own in described.items():
        require(related(own, "DEPENDS_ON") == {"libc6", "libfmt9"}, f"{name} depends on {related(own, 'DEPENDS_ON')}")
        inside = related(own, "CONTAINS")
        require({"Eigen", "three.js", "uPlot"} <= inside and ("SIMDe" in inside) == name.endswith("arm64"), f"{name} contains {inside}")
    file = folder / "sbom.spdx.json"
    file.write_text(json.dumps(bill))
    python = sys.argv[1] if len(sys.argv) > 1 and pathlib.Path(sys.argv[1]).exists() else sys.executable
    if subprocess.run([python, "-c", "import spdx_tools"], capture_output=True, check=False).returncode != 0:
        return print("not validated: spdx-tools are not installed")
    code = ("import sys; from spdx_tools.spdx.parser.parse_anything import parse_file; from spdx_tools.spdx.validation.document_validator import validate_full_spdx_document as v;"
            "print(*[m.validation_message for m in v(parse_file(sys.argv[1]))], sep='\\n')")
    require(run(python, "-c", code, file).stdout.strip() == "", "spdx-tools: " + run(python, "-c", code, file).stdout)


def check_site_versions(folder):
    site = folder / "site"
    script = REPOSITORY / "packaging/site/versions.py"
    site.mkdir()
    run(sys.executable, script, site, ok=False)
    for version in ("0.9.0", "next", "0.10.0", "assets"):
        (site / version).mkdir()
        if version != "assets":
            (site / version / "index.html").write_text(version)
    run(sys.executable, script, site)
    listed = [v["version"] for v in json.loads((site / "versions.json").read_text(encoding="utf-8"))]
    require(listed == ["0.10.0", "0.9.0", "next"], f"versions of the site: {listed}")
    require("url=0.10.0/index.html" in (site / "index.html").read_text(encoding="utf-8"), "the site's first page leads to the newest release")


def check_release(folder):
    """A release without its tag, without its key or of two versions is refused at once, not after an hour of building."""
    if not (REPOSITORY / ".git").exists():
        return print("./dev release: not tried, as this is no clone")
    clone = folder / "clone"
    run("git", "clone", "--quiet", "--shared", "--no-tags", REPOSITORY, clone)
    tag = "v" + re.search(r'^version = "(.*)"', (clone / "pyproject.toml").read_text(encoding="utf-8"), re.MULTILINE)[1]
    more = {"cwd": clone, "env": {**os.environ, "FBVINS_RELEASE_KEY": "nobody@localhost"}}
    require(f"the tag {tag} is not" in run("./dev", "release", ok=False, **more).stderr, "a release without its tag")
    run("git", "tag", tag, cwd=clone)
    done = run("./dev", "release", ok=False, **more)
    require(done.returncode == 2 and "no secret key nobody@localhost" in done.stderr, f"a release by a key that is not there: {done.stderr}")
    manifest = clone / "ros2/package.xml"
    manifest.write_text(re.sub("<version>.*</version>", "<version>9.8.7</version>", manifest.read_text(encoding="utf-8")), encoding="utf-8")
    run("git", "-c", "user.name=test", "-c", "user.email=test@localhost", "commit", "--quiet", "--all", "--message=another version", cwd=clone)
    run("git", "tag", "--force", tag, cwd=clone)
    require("versions differ" in run("./dev", "release", ok=False, **more).stderr, "a release with a version of its own in one file")
    require(not (clone / "out").exists(), "something was made")
    return None


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        built = folder / "built"
        built.mkdir()
        packages = [package(built, architecture) for architecture in ("amd64", "arm64")]
        check_bill(folder, packages)
        check_repository(folder, packages)
        check_site_versions(folder)
        check_release(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
