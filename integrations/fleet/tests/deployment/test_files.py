"""The deployment files are valid by their schemas, and ask for no more rights than they need."""

import configparser
import shutil
import subprocess
import sys
from pathlib import Path

import kubernetes_validate
import pytest
import yaml
from docker.utils.build import exclude_paths

ROOT = Path(__file__).resolve().parents[4]
EXAMPLES = ROOT / "integrations/fleet/examples"
BIN = Path(sys.executable).parent
UNIT = ROOT / "integrations/ros/examples/deploy/metaplan-ros.service"
CONTAINERFILES = [ROOT / "Containerfile", EXAMPLES / "Containerfile", ROOT / "integrations/ros/examples/deploy/Containerfile"]

RESOURCES = list(yaml.safe_load_all((EXAMPLES / "statefulset.yaml").read_text()))
KINDS = {resource["kind"]: resource for resource in RESOURCES}
COMPOSE = yaml.safe_load((EXAMPLES / "compose.yaml").read_text())


def of_git(*words):
    return set(subprocess.run(["git", *words, "-z"], cwd=ROOT, capture_output=True, check=True, text=True).stdout.split("\0")) - {""}


def test_compose_has_the_schema_of_compose():
    command = [BIN / "check-jsonschema", "--builtin-schema", "vendor.compose-spec", EXAMPLES / "compose.yaml"]
    assert subprocess.run(command, check=False).returncode == 0


@pytest.mark.parametrize("resource", RESOURCES, ids=lambda resource: resource["kind"])
def test_resources_have_the_schema_of_kubernetes(resource):
    kubernetes_validate.validate(resource, kubernetes_validate.latest_version(), strict=True)


def test_the_stateful_set_has_its_headless_service_and_probes():
    stateful, service = KINDS["StatefulSet"]["spec"], KINDS["Service"]
    labels = stateful["template"]["metadata"]["labels"]
    assert service["metadata"]["name"] == stateful["serviceName"] and service["spec"]["clusterIP"] == "None"
    for selector in (
        service["spec"]["selector"],
        stateful["selector"]["matchLabels"],
        KINDS["PodDisruptionBudget"]["spec"]["selector"]["matchLabels"],
    ):
        assert selector.items() <= labels.items()
    for container in stateful["template"]["spec"]["containers"]:
        ports = {port["name"] for port in container["ports"]}
        assert {port["targetPort"] for port in service["spec"]["ports"]} <= ports
        for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
            assert container[probe]["httpGet"]["port"] in ports
        for mount in container["volumeMounts"]:
            assert mount["name"] in {volume["name"] for volume in stateful["template"]["spec"]["volumes"]}


def test_pods_are_restricted():
    """Pod Security Standard `restricted`, https://kubernetes.io/docs/concepts/security/pod-security-standards/"""
    pod = KINDS["StatefulSet"]["spec"]["template"]["spec"]
    assert not pod.keys() & {"hostNetwork", "hostPID", "hostIPC"}
    assert pod["automountServiceAccountToken"] is False
    assert pod["securityContext"]["runAsNonRoot"] is True and pod["securityContext"]["runAsUser"] > 0
    assert pod["securityContext"]["seccompProfile"]["type"] == "RuntimeDefault"
    assert all(volume.keys() <= {"name", "secret", "configMap", "emptyDir"} for volume in pod["volumes"])
    for container in pod["containers"]:
        context = container["securityContext"]
        assert context["allowPrivilegeEscalation"] is False and context["readOnlyRootFilesystem"] is True
        assert context["capabilities"] == {"drop": ["ALL"]}


def test_services_of_compose_drop_capabilities():
    for name, service in COMPOSE["services"].items():
        assert service["cap_drop"] == ["ALL"] and "no-new-privileges:true" in service["security_opt"], name


@pytest.mark.parametrize("path", CONTAINERFILES, ids=lambda path: path.relative_to(ROOT).parts[0])
def test_container_files_have_no_complaint(path):
    command = [BIN / "hadolint", "--failure-threshold", "info", path]
    assert subprocess.run(command, check=False).returncode == 0


@pytest.mark.parametrize("path", CONTAINERFILES, ids=lambda path: path.relative_to(ROOT).parts[0])
def test_the_user_of_an_image_is_a_number_that_orchestrators_can_check(path):
    user = [line.split()[1] for line in path.read_text().splitlines() if line.startswith("USER")][-1]
    assert user.partition(":")[0].isdecimal() and not user.startswith("0")


def test_the_context_of_a_build_is_what_git_has():
    """A context without `target` and `.git` starts in a second; a context that lacks a file does not build."""
    patterns = (ROOT / ".dockerignore").read_text().splitlines()
    context = {str(path) for path in exclude_paths(str(ROOT), patterns) if (ROOT / path).is_file()}
    tracked = {path for path in of_git("ls-files") if (ROOT / path).is_file()} - {".dockerignore"}
    untracked = of_git("ls-files", "--others", "--exclude-standard")
    assert not tracked - context
    assert not context - tracked - untracked - {".dockerignore", ".git"}


def test_what_an_image_copies_is_there():
    for path in CONTAINERFILES:
        for line in path.read_text().splitlines():
            if line.startswith("COPY") and "--from" not in line:
                assert all((ROOT / source).exists() for source in line.split()[1:-1]), line


class Unit(configparser.ConfigParser):
    """A unit of systemd; of a key that is there several times, the last one counts."""

    def __init__(self, path):
        super().__init__(interpolation=None, strict=False)
        self.optionxform = str
        self.read_string(path.read_text())


def test_a_unit_is_not_started_again_with_a_wrong_input():
    service = Unit(UNIT)["Service"]
    assert service["Restart"] == "always" and service["RestartPreventExitStatus"].split() == ["2"]


def test_systemd_has_no_complaint_of_the_unit(tmp_path):
    if not shutil.which("systemd-analyze"):
        pytest.skip("systemd-analyze is not there")
    copy = tmp_path / UNIT.name
    # Its program need not be installed here.
    copy.write_text(UNIT.read_text().replace("/usr/local/bin/metaplan-ros", sys.executable))
    out = subprocess.run(["systemd-analyze", "verify", "--man=no", copy], capture_output=True, text=True, check=False)
    assert out.returncode == 0 and not out.stderr.strip(), out.stderr
