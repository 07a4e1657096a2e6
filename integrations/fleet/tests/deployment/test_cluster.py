"""The command lines of the deployment files are run: three servers and their workers, on loopback.

Host and port of each address become a free port of 127.0.0.1, paths of containers become directories, and nothing else
of a command changes. `NATS_SERVER` is the server, `METAPLAN_FLEET` the worker's program.
"""

import contextlib
import json
import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import time
import urllib.error
import urllib.request
from functools import partial
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[4]
EXAMPLES = ROOT / "integrations/fleet/examples"
COMPOSE = yaml.safe_load((EXAMPLES / "compose.yaml").read_text())
SERVERS = {name: own for name, own in COMPOSE["services"].items() if own["image"].startswith("nats:")}
WORKER = COMPOSE["services"]["worker"]
PODS = next(own for own in yaml.safe_load_all((EXAMPLES / "statefulset.yaml").read_text()) if own["kind"] == "StatefulSet")
POD = PODS["spec"]["template"]["spec"]["containers"][0]
NATS = os.environ.get("NATS_SERVER") or shutil.which("nats-server")
PROGRAM = Path(os.environ.get("METAPLAN_FLEET", ROOT / "target/debug/metaplan-fleet"))
SECONDS = 60

pytestmark = pytest.mark.skipif(NATS is None, reason="nats-server is not there")


def free_port():
    with socket.socket() as own:
        own.bind(("127.0.0.1", 0))
        return own.getsockname()[1]


class Cluster:
    """The processes of the containers, which all use 127.0.0.1."""

    def __init__(self, directory):
        self.directory = directory
        self.ports = {}
        self.processes = {}

    def port(self, host, port):
        return self.ports.setdefault((host, int(port)), free_port())

    def mapped(self, container, text):
        """Replaces the addresses in a text of a container. `nats` is the service of the servers in Kubernetes."""

        def address(match):
            host = {"0.0.0.0": container, "127.0.0.1": container, "nats": "nats-0"}.get(match[2], match[2])
            return f"{match[1] or ''}127.0.0.1:{self.port(host, match[3])}"

        text = re.sub(r"(\w+://)?\b([\w.-]+):(\d+)\b", address, text)
        return text.replace("/usr/share/metaplan", f"{self.directory}/image")

    def start(self, container, words, **environment):
        with (self.directory / f"{container}.log").open("w") as log:
            own = {**os.environ, **environment}
            self.processes[container] = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=own)

    def start_server(self, name, service):
        words = shlex.split(service["command"])
        for index, word in enumerate(words[:-1]):
            if word == "--http_port":
                words[index + 1] = str(self.port(name, words[index + 1]))
        store = service["volumes"][0].partition(":")[2]
        words = [f"{self.directory}/{name}" if word == store else self.mapped(name, word) for word in words]
        self.start(name, [NATS, *words, "--addr", "127.0.0.1", "--port", str(self.port(name, 4222))])

    def get(self, container, url):
        """Returns the body of a page of a container, or `None` if it is not available."""
        try:
            with urllib.request.urlopen(self.mapped(container, url), timeout=5) as page:
                return page.read().decode()
        except (urllib.error.URLError, ConnectionError, TimeoutError):
            return None

    def wait(self, what, holds):
        """Waits until `holds` returns a true value, and returns it. Fails if a process ends meanwhile."""
        end = time.monotonic() + SECONDS
        while not (value := holds()):
            for name, process in self.processes.items():
                assert process.poll() is None, f"{name} has ended with status {process.returncode}:\n{self.log(name)}"
            assert time.monotonic() < end, f"{what}: not within {SECONDS} s\n{''.join(map(self.log, self.processes))}"
            time.sleep(0.1)
        return value

    def log(self, name):
        return (self.directory / f"{name}.log").read_text()[-3000:]

    def stop(self):
        for process in reversed(self.processes.values()):
            process.send_signal(signal.SIGTERM)
        for process in self.processes.values():
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(10)
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    own = Cluster(tmp_path_factory.mktemp("cluster"))
    try:
        for name, service in SERVERS.items():
            own.start_server(name, service)
        yield own
    finally:
        own.stop()


def page(cluster, name, path):
    text = cluster.get(name, f"http://127.0.0.1:8222/{path}")
    return json.loads(text) if text else {}


def is_member(cluster, name):
    """Returns `True` if a server has routes to all others, and its JetStream a leader among all three."""
    routes = {route.get("remote_name") for route in page(cluster, name, "routez").get("routes", [])}
    meta = page(cluster, name, "jsz").get("meta_cluster", {})
    return routes == SERVERS.keys() - {name} and meta.get("cluster_size") == 3 and meta.get("leader") in SERVERS


def test_servers_of_compose_form_a_cluster_with_jetstream(cluster):
    assert len(SERVERS) == 3
    for name, service in SERVERS.items():
        check = service["healthcheck"]["test"][-1]
        cluster.wait(f"{name} is healthy", partial(cluster.get, name, check))
        cluster.wait(f"{name} is a member of the cluster", partial(is_member, cluster, name))
        described = page(cluster, name, "varz")
        assert described["server_name"] == name and described["cluster"]["name"] == "fleet"


def image(directory):
    """Copies the files of the image, without the program, to a folder `image`."""
    for line in (EXAMPLES / "Containerfile").read_text().splitlines():
        if line.startswith("COPY") and "/usr/share/metaplan" in line:
            source, target = line.split()[1:]
            target = target.replace("/usr/share/metaplan", f"{directory}/image")
            shutil.copytree(ROOT / source, target, dirs_exist_ok=True)


def test_workers_of_both_files_work_on_them(cluster):
    assert PROGRAM.exists(), f"{PROGRAM} has not been built"
    image(cluster.directory)
    environment = {name: cluster.mapped("", value) for name, value in WORKER["environment"].items()}
    for name in ("compose-1", "compose-2"):
        words = [cluster.mapped(name, word) for word in shlex.split(WORKER["command"])]
        cluster.start(name, [PROGRAM, *words], **environment)
    # The servers of this test have neither TLS nor credentials.
    secrets = ("--creds", "--tls-ca")
    words = [cluster.mapped("pod", word.replace("$(POD)", "pod")) for word in POD["args"] if not word.startswith(secrets)]
    words = [word.replace("tls:", "nats:") for word in words]
    cluster.start("pod", [PROGRAM, *words])
    ports = {port["name"]: port["containerPort"] for port in POD["ports"]}
    for name in ("startupProbe", "readinessProbe", "livenessProbe"):
        probe = POD[name]["httpGet"]
        url = f"http://127.0.0.1:{ports[probe['port']]}{probe['path']}"
        for worker in ("compose-1", "compose-2", "pod"):
            cluster.wait(f"{name} of {worker}", partial(cluster.get, worker, url))

    def ask(*words, text=None):
        out = subprocess.run(
            [PROGRAM, *words], env={**os.environ, **environment}, input=text, capture_output=True, text=True, timeout=SECONDS, check=True
        )
        return out.stdout

    ask("send", text='ugv-1 {"event": "enrol", "mission": "ugv"}\n')
    with subprocess.Popen(
        [PROGRAM, "follow", "ugv-1", "--after", "0"], env={**os.environ, **environment}, stdout=subprocess.PIPE, text=True
    ) as following:
        try:
            os.set_blocking(following.stdout.fileno(), False)
            output = []

            def has_plan():
                output.append(following.stdout.readline())
                return "plan_found" in "".join(output)

            # The first decision has no plan if the search takes longer than it waits.
            cluster.wait("a plan", has_plan)
        finally:
            following.kill()
    for worker in ("compose-1", "compose-2", "pod"):
        process = cluster.processes.pop(worker)
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 0, cluster.log(worker)


def test_a_worker_waits_for_a_server_that_starts_later(tmp_path):
    image(tmp_path)
    own = Cluster(tmp_path)
    address = f"127.0.0.1:{own.port('server', 4222)}"
    try:
        words = ["--nats", f"nats://{address}", "--missions", f"{tmp_path}/image/missions"]
        own.start("worker", [PROGRAM, "worker", *words])
        own.wait("a warning", lambda: "the servers are not ready" in own.log("worker"))
        own.start("server", [NATS, "--js", "--sd", f"{tmp_path}/server", "--addr", "127.0.0.1", "--port", address.partition(":")[2]])

        def is_owned():
            words = ["status", "--nats", f"nats://{address}", "--format", "json"]
            out = subprocess.run([PROGRAM, *words], capture_output=True, text=True, timeout=SECONDS, check=False)
            return out.returncode == 0 and any(partition["worker"] for partition in json.loads(out.stdout)["partitions"])

        own.wait("an owner of a partition", is_owned)
    finally:
        own.stop()


def test_a_refused_user_is_an_error_at_once(tmp_path):
    own = Cluster(tmp_path)
    port = own.port("server", 4222)
    own.start("server", [NATS, "--addr", "127.0.0.1", "--port", str(port), "--user", "robot", "--pass", "right"])
    try:
        url = f"nats://127.0.0.1:{port}"
        begun = time.monotonic()
        words = [PROGRAM, "status", "--nats", url, "--user", "robot", "--wait", "50"]
        out = subprocess.run(words, env={**os.environ, "NATS_PASSWORD": "wrong"}, capture_output=True, text=True, timeout=SECONDS, check=False)
        assert out.returncode == 2 and "error[N311]" in out.stderr and "authorization violation" in out.stderr, out.stderr
        assert time.monotonic() - begun < 40
    finally:
        own.stop()


@pytest.fixture
def server(tmp_path):
    own = Cluster(tmp_path)
    port = own.port("server", 4222)
    words = ["--js", "--sd", f"{tmp_path}/server", "--addr", "127.0.0.1", "--port", str(port)]
    own.start("server", [NATS, *words, "--http_port", str(own.port("server", 8222))])
    try:
        yield own, f"nats://127.0.0.1:{port}"
    finally:
        own.stop()


def certify(directory):
    """Creates a certificate authority `ca.crt`, and a certificate of it for 127.0.0.1, `server.crt` with `server.key`."""

    def openssl(*words):
        subprocess.run(["openssl", *words], cwd=directory, capture_output=True, check=True)

    key = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2")
    openssl("req", "-x509", *key, "-keyout", "ca.key", "-out", "ca.crt", "-subj", "/CN=test")
    openssl("req", *key, "-keyout", "server.key", "-out", "server.csr", "-subj", "/CN=server")
    (directory / "names").write_text("subjectAltName=IP:127.0.0.1")
    authority = ("-CA", "ca.crt", "-CAkey", "ca.key", "-CAcreateserial")
    openssl("x509", "-req", "-in", "server.csr", *authority, "-days", "2", "-extfile", "names", "-out", "server.crt")


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not there")
def test_a_pod_trusts_the_certificate_authority_of_its_secret(tmp_path):
    image(tmp_path)
    certify(tmp_path)
    own = Cluster(tmp_path)
    url = f"tls://127.0.0.1:{own.port('nats-0', 4222)}"
    tls = ["--tls", "--tlscert", f"{tmp_path}/server.crt", "--tlskey", f"{tmp_path}/server.key"]
    store = ["--js", "--sd", f"{tmp_path}/server"]
    try:
        own.start("server", [NATS, *store, *tls, "--addr", "127.0.0.1", "--port", url.rpartition(":")[2]])
        # There is one server, and it needs no credentials.
        words = [word for word in POD["args"] if not word.startswith(("--creds", "--replicas"))]
        words = [own.mapped("pod", word.replace("$(POD)", "pod")) for word in words]
        own.start("pod", [PROGRAM, *(word.replace("/secrets/", f"{tmp_path}/") for word in words)])
        own.wait("a worker that is ready", lambda: own.get("pod", f"http://127.0.0.1:9464{POD['readinessProbe']['httpGet']['path']}"))
        out = call("status", "--nats", url)
        assert out.returncode == 2 and "error[N311]" in out.stderr, out.stderr
    finally:
        own.stop()


def can_isolate():
    return bool(shutil.which("unshare")) and subprocess.run(["unshare", "-rpf", "true"], capture_output=True, check=False).returncode == 0


@pytest.mark.skipif(not can_isolate(), reason="there are no namespaces for processes")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_signal_ends_a_program_that_is_process_1(tmp_path, name):
    own = Cluster(tmp_path)
    try:
        words = [PROGRAM, "send", "--nats", f"nats://127.0.0.1:{free_port()}", "--wait", "600"]
        own.start("send", ["unshare", "-rpf", "--kill-child", *words])
        own.wait("a program that waits for servers", lambda: "the servers are not ready" in own.log("send"))
        unshare = own.processes["send"]
        (program,) = Path(f"/proc/{unshare.pid}/task/{unshare.pid}/children").read_text().split()
        os.kill(int(program), signal.Signals[name])
        assert unshare.wait(SECONDS) == 130
    finally:
        own.stop()


def test_a_line_that_is_not_acknowledged_is_repeated_with_a_warning(server):
    cluster, url = server
    assert call("status", "--nats", url).returncode == 0
    log = cluster.directory / "send.log"
    words = [PROGRAM, "send", "--nats", url]
    with log.open("w") as errors, subprocess.Popen(words, stdin=subprocess.PIPE, stderr=errors, text=True) as sending:
        try:
            # The program is connected when its first line is stored.
            sending.stdin.write('r {"event": "tick"}\n')
            sending.stdin.flush()
            cluster.wait("a stored line", lambda: "last_seq\": 1" in (cluster.get("server", "http://127.0.0.1:8222/jsz?streams=1") or ""))
            cluster.processes["server"].send_signal(signal.SIGSTOP)
            sending.stdin.write('r {"event": "tick"}\n')
            sending.stdin.close()
            cluster.wait("a warning", lambda: "the log does not respond" in log.read_text())
            assert sending.poll() is None
            cluster.processes["server"].send_signal(signal.SIGCONT)
            assert sending.wait(SECONDS) == 0, log.read_text()
        finally:
            cluster.processes["server"].send_signal(signal.SIGCONT)
            sending.kill()


def call(*words, text=""):
    return subprocess.run([PROGRAM, *words], input=text, capture_output=True, text=True, timeout=SECONDS, check=False)


def test_a_line_that_is_not_stored_is_an_error(server):
    long = json.dumps({"event": "tick", "note": "x" * 1_200_000})
    out = call("send", "--nats", server[1], text=f'r {{"event": "tick"}}\nr {long}\nr {{"event": "tick"}}\n')
    assert out.returncode == 2 and "error[N315]: line 2, robot `r`" in out.stderr and "2 events were stored" in out.stderr, out.stderr


def test_fleets_share_a_server(server, tmp_path):
    cluster, url = server
    image(tmp_path)
    for fleet in ("fleet", "north"):
        words = ["--nats", url, "--fleet", fleet, "--missions", f"{tmp_path}/image/missions", "--partitions", "1"]
        cluster.start(fleet, [PROGRAM, "worker", *words])
    for fleet in ("fleet", "north"):
        out = call("send", "--nats", url, "--fleet", fleet, text='ugv-1 {"event": "enrol", "mission": "ugv"}\n')
        assert out.returncode == 0, out.stderr
    for fleet in ("fleet", "north"):
        words = [PROGRAM, "follow", "ugv-1", "--after", "0", "--nats", url, "--fleet", fleet]
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as following:
            try:
                os.set_blocking(following.stdout.fileno(), False)
                decided = cluster.wait("a decision", following.stdout.readline)
            finally:
                following.kill()
        # Each fleet counts its own events.
        assert json.loads(decided.partition(" ")[2])["event"] == 1
    out = call("status", "--nats", url, "--fleet", "no.name")
    assert out.returncode == 2 and "is not a name of a fleet" in out.stderr, out.stderr
