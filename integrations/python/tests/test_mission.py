"""Missions: the package must give the same answers as the command line."""

import asyncio
import copy
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import pytest

import metaplan

ROOT = Path(__file__).resolve().parents[3]
UGV = ROOT / "missions/ugv.toml"

DOMAIN = """(define (domain d) (:requirements :typing :action-costs) (:types place)
 (:predicates (at ?p - place) (way ?a ?b - place)) (:functions (total-cost) - number (length ?a ?b - place) - number)
 (:action go :parameters (?a ?b - place) :precondition (and (at ?a) (way ?a ?b))
  :effect (and (not (at ?a)) (at ?b) (increase (total-cost) (length ?a ?b)))))"""
PROBLEM = """(define (problem p) (:domain d) (:objects a b c - place)
 (:init (at a) (way a b) (way b c) (= (total-cost) 0) (= (length a b) 1.5) (= (length b c) 2))
 (:goal (at c)) (:metric minimize (total-cost)))"""


def test_a_plan_has_what_the_command_line_prints():
    plan = metaplan.Mission.load(UGV).plan()
    assert plan.optimal and plan and plan.cost == 408 and len(plan) == 4
    assert plan.steps[0].action == "move" and plan.steps[0].configuration == {"f_localization": "fd_amcl_kinect"}
    assert plan.to_dict()["format"] == "metaplan-plan/1"
    assert plan.lower_bound == plan.cost and plan.verdict.startswith("optimal, proved")
    assert plan.svg().startswith("<?xml") and "</p><svg" in plan._repr_html_()


def test_what_fails_changes_the_plan_and_copies_keep_a_situation():
    mission = metaplan.Mission.load(UGV)
    before = mission.copy()
    after = mission.fail("c_kinect").set(robot_at="wp2").plan()
    assert after.cost != before.plan().cost
    assert "fd_amcl_kinect" not in {design for step in after for design in step.configuration.values()}


def test_numbers_are_exact():
    plan = metaplan.Mission.from_files(DOMAIN, PROBLEM).plan()
    assert plan.cost == Decimal("3.5") and isinstance(plan.cost, Decimal)
    assert plan.text == "(go a b)\n(go b c)\n"
    assert plan.to_df()["cost"].sum() == 3.5


def test_classes_derived_from_float_are_numbers():
    class Number(float):
        def __repr__(self):
            return f"np.float64({float(self)!r})"

    own, plain = (metaplan.Mission.load(UGV).set(ambient_light=number) for number in (Number(0.9), 0.9))
    assert own.pddl() == plain.pddl()


def test_fractions_are_exact_and_numbers_of_a_plan_go_together():
    problem = PROBLEM.replace("(length a b) 1.5", "(length a b) (/ 1 3)").replace("(length b c) 2", "(length b c) 0.5")
    mission = metaplan.Mission.from_files(DOMAIN, problem)
    plan = mission.plan()
    assert plan.cost == Fraction(5, 6) == plan.lower_bound
    assert [step.cost for step in plan] == [Fraction(1, 3), Fraction(1, 2)] and sum(step.cost for step in plan) == plan.cost
    assert plan.to_df()["cost"].tolist() == [1 / 3, 0.5]
    assert mission.plan(minimize="total-cost").objectives == {"total-cost": Fraction(5, 6)}
    assert mission.plan(pareto=("total-cost", "total-time")).points[0].cost == Fraction(5, 6)
    assert mission.plan(concurrent=Fraction(1, 7)).makespan == Fraction(1, 7)


SOURCES = {
    "path": lambda: metaplan.Mission.load(os.path.relpath(UGV)),
    "text": lambda: metaplan.Mission.load(UGV.read_text(), os.path.relpath(ROOT / "missions")),
    "mapping": lambda: metaplan.Mission.load(OWN, os.path.relpath(ROOT)),
    "PDDL": lambda: metaplan.Mission.from_files(DOMAIN, PROBLEM, name="own"),
    "files": lambda: metaplan.Mission.from_files(*FILES, [os.path.relpath(UGV_KB)], rules=["coadaptation"]),
}
OWN = {
    "name": "mine",
    "knowledge": {"files": ["ontology/kb/ugv.ttl"]},
    "planning": {"domain": "encodings/ugv/domain.pddl", "problem": "encodings/ugv/problem.pddl"},
}
FILES = [ROOT / f"encodings/ugv/{name}.pddl" for name in ("domain", "problem")]
UGV_KB = ROOT / "ontology/kb/ugv.ttl"


@pytest.mark.parametrize("source", SOURCES)
def test_missions_are_pickled_with_their_situation(source, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mission = SOURCES[source]()
    if source == "PDDL":
        mission.set("length a b", Decimal("0.25"))
    else:
        mission.fail("c_kinect").set(robot_at="wp2")
    # A separate process in another directory, like a worker of a process pool.
    Path("elsewhere").mkdir()
    program = "import pickle, sys; plan = pickle.load(sys.stdin.buffer).plan(); pickle.dump(plan, sys.stdout.buffer)"
    out = subprocess.run([sys.executable, "-c", program], input=pickle.dumps(mission), cwd="elsewhere", capture_output=True, check=False)
    assert out.returncode == 0, out.stderr.decode()
    plan, own = pickle.loads(out.stdout), mission.plan()
    assert plan.steps == own.steps and plan.cost == own.cost and plan.text == own.text and plan.svg() == own.svg()
    for copied in (copy.copy(mission), copy.deepcopy(mission)):
        assert copied.name == mission.name and copied.pddl() == mission.pddl()


def test_a_mission_is_pickled_with_its_files_after_a_change_of_the_directory(tmp_path, monkeypatch):
    mission = metaplan.Mission.load(os.path.relpath(UGV))
    monkeypatch.chdir(tmp_path)
    assert pickle.loads(pickle.dumps(mission)).name == mission.name


def test_a_pickled_mission_whose_files_have_changed_is_refused(tmp_path):
    for name, text in (("d.pddl", DOMAIN), ("p.pddl", PROBLEM)):
        (tmp_path / name).write_text(text)
    pickled = pickle.dumps(metaplan.Mission.from_files(tmp_path / "d.pddl", tmp_path / "p.pddl"))
    assert pickle.loads(pickled).plan()
    (tmp_path / "p.pddl").write_text(PROBLEM.replace("1.5", "2.5"))
    with pytest.raises(pickle.UnpicklingError, match="have changed"):
        pickle.loads(pickled)


def test_answers_are_pickled_and_copied():
    mission = metaplan.Mission.load(UGV)
    with pytest.raises(metaplan.Error) as caught:
        mission.fail("c_kinekt")
    verdict = mission.validate(mission.plan())
    answers = [mission.plan(), verdict, mission.explain(), metaplan.reason(UGV_KB), caught.value, *mission.run([])]
    answers += [metaplan.Mission.from_files(DOMAIN, PROBLEM).plan(pareto=("total-cost", "total-time"))]
    for answer in answers:
        for copied in (pickle.loads(pickle.dumps(answer)), copy.copy(answer), copy.deepcopy(answer)):
            assert type(copied) is type(answer) and str(copied) == str(answer)
            if not isinstance(answer, Exception):
                assert copied.to_dict() == answer.to_dict()


def test_an_answer_of_the_loop_shows_its_content():
    shown = {answer.kind: repr(answer) for answer in metaplan.Mission.load(UGV).run([])}
    assert shown["request_action"].startswith("LoopAnswer('request_action', ")
    assert "name='move'" in shown["request_action"] and "'wp1', 'wp2']" in shown["request_action"]


def test_errors_have_code_and_place():
    with pytest.raises(metaplan.Error) as caught:
        metaplan.Mission.from_files(DOMAIN.replace("(at ?a) (way", "(at ?a) (ways"), PROBLEM)
    error = caught.value
    assert error.file == "domain" and error.line == 3 and error.column > 1 and error.code[0] == "P"
    assert metaplan.explain_code(error.code).to_dict()["code"] == error.code
    with pytest.raises(metaplan.Error) as caught:
        metaplan.Mission.load(UGV).fail("c_kinekt")
    assert "c_kinect" in str(caught.value)
    with pytest.raises(KeyError):
        metaplan.explain_code("X999")


def test_manifests_are_files_texts_and_mappings():
    text = UGV.read_text()
    assert metaplan.Mission.load(text, ROOT / "missions").plan().cost == 408
    mission = metaplan.Mission.load(OWN, ROOT)
    assert mission.name == "mine" and mission.plan()
    with pytest.raises(metaplan.Error):
        metaplan.Mission.load({**OWN, "planing": {}}, ROOT)


def test_texts_of_a_manifest_can_have_quotes_and_backslashes():
    text = 'robot \U0001f916 "R\\1"'
    assert metaplan.Mission.load({**OWN, "name": text}, ROOT).name == text


def test_objectives_fronts_and_alternatives():
    mission = metaplan.Mission.from_files(DOMAIN, PROBLEM)
    assert mission.plan(minimize=["total-cost"]).objectives == {"total-cost": Decimal("3.5")}
    front = mission.plan(pareto=("total-cost", "total-time"))
    assert front.status == "optimal" and len(front) == 1 and front.to_df().shape == (1, 3)
    assert mission.plan(alternatives=3).alternatives == []


def test_plans_are_validated():
    mission = metaplan.Mission.from_files(DOMAIN, PROBLEM)
    plan = mission.plan()
    assert mission.validate(plan).valid and mission.validate(plan.text).metric == Decimal("3.5")
    verdict = metaplan.validate(DOMAIN, PROBLEM, "(go a c)\n")
    assert not verdict and verdict.violation["step"] == 1


def test_certificates_are_written_and_checked(tmp_path):
    mission = metaplan.Mission.load(UGV)
    verification = mission.certify(tmp_path / "proof")
    assert verification and "verified: the plan is optimal" in str(verification)
    (tmp_path / "proof/plan.txt").write_text("")
    assert not metaplan.verify(tmp_path / "proof")
    assert not metaplan.verify(tmp_path / "nothing").verified


def test_explanations():
    mission = metaplan.Mission.load(UGV)
    assert mission.explain().to_dict()["changes"]
    assert mission.explain("fd_amcl_lidar").to_dict()["available"] is True


def test_reasoning():
    answer = metaplan.reason(ROOT / "ontology/kb/ugv.ttl", rules=["coadaptation"], fail=["c_kinect"]).to_dict()
    assert answer["format"].startswith("metaplan-reason/")
    lost = [design["name"] for design in answer["designs"] if not design["available"]]
    assert "fd_amcl_kinect" in lost


def test_model_checking():
    model = "dtmc\nmodule m\n s:[0..2] init 0;\n [] s=0 -> p:(s'=1)+(1-p):(s'=2);\nendmodule\nconst double p;\nlabel \"goal\" = s=1;\n"
    answer = metaplan.check(model, 'P=? [ F "goal" ]', constants={"p": 0.25}).to_dict()
    assert answer["value"] == 0.25
    with pytest.raises(metaplan.Error) as caught:
        metaplan.check(model, "P=? [ F goal")
    assert caught.value.line == 1


def test_the_loop_gives_the_same_answers_for_asyncio():
    events = [
        {"event": "action_succeeded", "action": 1, "time": 5},
        {"event": "component_status", "component": "c_kinect", "status": "FALSE", "time": 6},
    ]
    answers = list(metaplan.Mission.load(UGV).run(events))
    kinds = [answer.kind for answer in answers]
    assert "error" not in kinds, answers
    assert "plan_found" in kinds and answers[0].to_dict()["answer"] == answers[0].kind

    async def heard():
        async def stream():
            for event in events:
                yield event

        return [answer.kind async for answer in metaplan.Mission.load(UGV).arun(stream())]

    assert asyncio.run(heard()) == kinds


def test_the_plan_is_compared_with_policies():
    comparison = metaplan.Mission.load(ROOT / "missions/camara_like.toml").compare()
    kinds = {own["kind"] for own in comparison.candidates}
    assert {"a", "f"} <= kinds and comparison.front
    assert len(comparison.to_df()) == len(comparison.candidates) and "<table>" in comparison._repr_html_()


@pytest.mark.parametrize("penalty", [-100, float("inf"), float("nan")])
def test_a_penalty_is_a_time(penalty):
    with pytest.raises(ValueError, match="penalty"):
        metaplan.Mission.load(ROOT / "missions/camara_like.toml").compare(penalty=penalty)


def test_a_component_that_no_configuration_needs_cannot_be_lost():
    with pytest.raises(metaplan.Error, match="M125"):
        metaplan.Mission.load(ROOT / "missions/camara_like.toml").compare(loss=("c_unknown", 0.1))


def test_a_signal_ends_a_check(tmp_path):
    model = tmp_path / "long.prism"
    model.write_text("dtmc module m x:[0..40000000]; [] x<40000000 -> (x'=x+1); endmodule")

    def stop(*_):
        raise KeyboardInterrupt

    former = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, 0.3)
    try:
        with pytest.raises(KeyboardInterrupt):
            metaplan.check(model, "P=? [ F x=40000000 ]")
    finally:
        signal.signal(signal.SIGALRM, former)


def tour(places):
    """Returns a tour of all places: a plan is found immediately, but an optimal plan is not."""
    names = [f"p{index}" for index in range(places)]
    length = {(a, b): 10 + (7 * i * i + 13 * j * j + 5 * i * j) % 83 for i, a in enumerate(names) for j, b in enumerate(names) if a != b}
    facts = " ".join(f"(way {a} {b}) (= (length {a} {b}) {far})" for (a, b), far in length.items())
    domain = DOMAIN.replace("(at ?p - place)", "(at ?p - place) (seen ?p - place)").replace("(at ?b) (inc", "(at ?b) (seen ?b) (inc")
    problem = f"""(define (problem p) (:domain d) (:objects {" ".join(names)} - place) (:init (at p0) {facts} (= (total-cost) 0))
      (:goal (and {" ".join(f"(seen {name})" for name in names)})) (:metric minimize (total-cost)))"""
    return domain, problem


def test_improvements_are_heard_and_end_the_search():
    heard = []
    mission = metaplan.Mission.from_files(*tour(8))
    plan = mission.plan(on_improvement=lambda *own: heard.append(own))
    assert plan.optimal and heard and all(bound <= cost for cost, bound, _, _ in heard)
    ended = metaplan.Mission.from_files(*tour(25)).plan(on_improvement=lambda *_: False)
    assert not ended.optimal and ended.steps

    def wrong(*_):
        raise RuntimeError("no")

    with pytest.raises(RuntimeError):
        mission.plan(on_improvement=wrong)


def test_control_c_gives_the_best_plan_so_far(tmp_path):
    (tmp_path / "d.pddl").write_text((texts := tour(25))[0])
    (tmp_path / "p.pddl").write_text(texts[1])
    program = """
import metaplan, sys
first = True
def heard(*_):
    global first
    if first: print("begun", flush=True)
    first = False
plan = metaplan.Mission.from_files(open(sys.argv[1]).read(), open(sys.argv[2]).read()).plan(on_improvement=heard)
print(plan.status, len(plan.steps))
"""
    command = [sys.executable, "-c", program, tmp_path / "d.pddl", tmp_path / "p.pddl"]
    # A background job of a shell ignores the signal, and its child processes would inherit this.
    heeds = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)  # noqa: E731
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, preexec_fn=heeds) as process:
        assert process.stdout.readline() == "begun\n"
        process.send_signal(signal.SIGINT)
        status, steps = process.stdout.readline().split()
        assert process.wait(60) == 0
    assert status != "optimal" and int(steps) >= 24


def test_threads_plan_at_once():
    mission = metaplan.Mission.load(UGV)
    costs = []
    threads = [threading.Thread(target=lambda: costs.append(mission.plan().cost)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert costs == [408] * 4


def test_a_mission_changes_while_it_is_planned_for():
    mission = metaplan.Mission.load(UGV)

    def heard(*_):
        changing = threading.Thread(target=mission.fail, args=("c_kinect",))
        changing.start()
        changing.join(30)
        assert not changing.is_alive()

    plan = mission.plan(on_improvement=heard)
    assert plan.cost == 408 and "<svg" in plan.svg()
    assert mission.plan().cost > 408


def test_answers_are_those_of_the_program():
    program = ROOT / "target/debug/metaplan"
    if not program.exists():
        pytest.skip("the program has not been built")
    output = subprocess.run([program, "plan", UGV, "--format", "json"], capture_output=True, check=True)
    said, own = json.loads(output.stdout), metaplan.Mission.load(UGV).plan().to_dict()
    for answer in (said, own):
        del answer["statistics"]["milliseconds"]
    assert said == own


def test_memory_does_not_grow():
    resource = pytest.importorskip("resource", reason="not on this platform")
    mission = metaplan.Mission.load(UGV)

    def peak():
        for _ in range(250):
            mission.plan()
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    peaks = [peak() for _ in range(4)]
    assert peaks[-1] - peaks[0] < 4096, peaks  # in KiB
