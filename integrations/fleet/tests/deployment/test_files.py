"""The deployment files are valid according to their schemas, and request no more rights than needed."""

import configparser
import json
import re
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

SOURCES = "\n".join(path.read_text() for path in sorted((ROOT / "integrations/fleet/src").rglob("*.rs")))
METRICS = {name: kind for kind, name in re.findall(r'metrics::(counter|gauge|histogram)!\(\s*"(\w+)"', SOURCES)}
MANUAL = (ROOT / "docs/how-to/machines.md").read_text()
RUNBOOK = (ROOT / "docs/how-to/operate-fleet.md").read_text()
DASHBOARD = json.loads((EXAMPLES / "grafana.json").read_text())
ALERTS_TEXT = (EXAMPLES / "alerts.yaml").read_text()
ALERTS = [rule for group in yaml.safe_load(ALERTS_TEXT)["groups"] for rule in group["rules"]]
QUERIES = [target["expr"] for panel in DASHBOARD["panels"] for target in panel["targets"]]


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


def test_pods_with_tls_have_a_certificate_authority():
    """The public authorities of the image do not sign names inside a cluster."""
    pod = KINDS["StatefulSet"]["spec"]["template"]["spec"]
    for container in pod["containers"]:
        arguments = dict(word.removeprefix("--").partition("=")[::2] for word in container["args"])
        assert arguments["nats"].startswith("tls://")
        assert any(arguments["tls-ca"].startswith(f"{mount['mountPath']}/") for mount in container["volumeMounts"])


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
    """A context without `target` and `.git` is sent in a second. An image cannot be built from a context that lacks a file."""
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
    """A unit of systemd. If a key occurs several times, the last value is used."""

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
    # The program of the unit need not be installed here.
    copy.write_text(UNIT.read_text().replace("/usr/local/bin/metaplan-ros", sys.executable))
    out = subprocess.run(["systemd-analyze", "verify", "--man=no", copy], capture_output=True, text=True, check=False)
    assert out.returncode == 0 and not out.stderr.strip(), out.stderr


def metrics_in(text):
    """Returns the metrics in a text, without the suffixes `_sum` and `_count` that the exporter adds to histograms."""
    names = set()
    for name in re.findall(r"\bmetaplan_fleet_\w+", text):
        base = re.sub(r"_(sum|count)$", "", name)
        names.add(base if METRICS.get(base) == "histogram" else name)
    return names


def test_the_sources_have_metrics():
    assert set(METRICS.values()) == {"counter", "gauge", "histogram"} and len(METRICS) >= 11
    # Each macro in the sources has its name as a literal, so that the pattern matches it.
    assert len(re.findall(r"metrics::(?:counter|gauge|histogram)!", SOURCES)) == len(METRICS)


def test_metrics_of_the_files_are_those_of_the_sources():
    table = MANUAL.partition("## Metrics and probes")[2]
    for text in (table, "\n".join(QUERIES)):
        assert metrics_in(text) == METRICS.keys()
    for text in (MANUAL, ALERTS_TEXT, RUNBOOK, json.dumps(DASHBOARD)):
        assert metrics_in(text) <= METRICS.keys()


def test_quantiles_are_those_of_the_exporter():
    """The exporter's builder sets neither buckets nor quantiles, so there are no `_bucket` series."""
    assert not re.search(r"set_(native_)?(buckets|quantiles)", SOURCES)
    text = "\n".join([*QUERIES, *(rule["expr"] for rule in ALERTS)])
    assert "histogram_quantile" not in text and "_bucket" not in text
    assert set(re.findall(r'quantile="([^"]*)"', text)) <= {"0", "0.5", "0.9", "0.95", "0.99", "0.999", "1"}


def test_reasons_of_the_runbook_are_those_of_the_sources():
    robot = (ROOT / "integrations/fleet/src/robot.rs").read_text()
    variants = re.findall(r"^    (\w+),$", robot.partition("pub enum Refused {")[2].partition("\n}")[0], re.MULTILINE)
    # The names are the variants in snake case.
    own = {re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower() for name in variants} | set(re.findall(r'\.refuse\(\s*"(\w+)"', SOURCES))
    assert {"not_enrolled", "wrong_subject"} <= own
    section = RUNBOOK.partition("## Events are refused")[2].partition("\n## ")[0]
    assert set(re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE)) - {"reason"} == own
    assert set(re.findall(r'reason!="(\w+)"', ALERTS_TEXT)) <= own


def test_alerts_of_the_runbook_are_those_of_the_file():
    rows = re.findall(r"^\| \[(\w+)\]\(#([\w-]+)\) \| `([^`]*)` \| (\w*) *\|$", RUNBOOK, re.MULTILINE)
    assert [(name, expression, time) for name, _, expression, time in rows] == [
        (rule["alert"], " ".join(rule["expr"].split()), rule.get("for", "")) for rule in ALERTS
    ]
    headings = {re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-") for heading in re.findall(r"^## (.*)$", RUNBOOK, re.MULTILINE)}
    assert {anchor for anchor in re.findall(r"\]\(#([\w-]+)\)", RUNBOOK)} <= headings


@pytest.mark.parametrize("words", [["check", "rules", EXAMPLES / "alerts.yaml"], ["test", "rules", Path(__file__).parent / "alerts.yaml"]], ids=lambda words: words[0])
def test_promtool_accepts_the_alerts(words):
    if not shutil.which("promtool"):
        pytest.skip("promtool is not there")
    out = subprocess.run(["promtool", *words], capture_output=True, text=True, check=False)
    assert out.returncode == 0, out.stdout + out.stderr


def test_the_dashboard_can_be_imported_everywhere():
    variables = {variable["name"]: variable for variable in DASHBOARD["templating"]["list"]}
    assert variables["datasource"]["type"] == "datasource" and variables["datasource"]["query"] == "prometheus"
    # Every panel and query uses the data source that the reader selects.
    own = {"type": "prometheus", "uid": "${datasource}"}
    panels = DASHBOARD["panels"]
    for part in [*panels, *(target for panel in panels for target in panel["targets"]), variables["job"], variables["instance"]]:
        assert part["datasource"] == own
    for query in QUERIES:
        assert set(re.findall(r"\$(\w+)", query)) <= {"job", "instance", "__rate_interval"} and 'job="$job"' in query
    assert "://" not in json.dumps(DASHBOARD) and not DASHBOARD["links"] and "id" not in DASHBOARD
    assert len({panel["id"] for panel in panels}) == len(panels)
    places = {(x, y) for panel in panels for x in range(panel["gridPos"]["x"], panel["gridPos"]["x"] + panel["gridPos"]["w"]) for y in [panel["gridPos"]["y"]]}
    assert len(places) == sum(panel["gridPos"]["w"] for panel in panels) and all(x < 24 for x, _ in places)
