"""Exchange of knowledge bases with other libraries."""

import pickle
from pathlib import Path

import pytest

rdflib = pytest.importorskip("rdflib", reason="rdflib is not there")

from rdflib.compare import isomorphic

import metaplan
import metaplan.kb

ROOT = Path(__file__).resolve().parents[3]
UGV = ROOT / "ontology/kb/ugv.ttl"
FILES = [ROOT / f"encodings/ugv/{name}.pddl" for name in ("domain", "problem")]
TOMASYS = "http://metacontrol.org/tomasys#"


def test_an_rdflib_graph_is_a_knowledge_base(tmp_path):
    knowledge = metaplan.kb.load(rdflib.Graph().parse(UGV))
    own = metaplan.reason(UGV, fail=["c_kinect"]).to_dict()["inferred"]
    assert knowledge.reason(fail=["c_kinect"]).to_dict()["inferred"] == own
    assert len(knowledge.inferred(fail=["c_kinect"])) == len(own)
    assert metaplan.Mission.from_files(*FILES, [knowledge]).plan().cost == 408
    copied = pickle.loads(pickle.dumps(knowledge))
    assert copied.reason().to_dict()["inferred"] == knowledge.reason().to_dict()["inferred"]
    kept = metaplan.kb.load(rdflib.Graph().parse(UGV), tmp_path / "kb.nt")
    assert kept.path.read_bytes() == knowledge.path.read_bytes()


def test_an_owlready2_world_is_a_knowledge_base(tmp_path):
    owlready2 = pytest.importorskip("owlready2", reason="owlready2 is not there")
    for name in ("tomasys", "ugv"):
        metaplan.kb.load(rdflib.Graph().parse(ROOT / f"ontology/kb/{name}.ttl"), tmp_path / f"{name}.nt")
    owlready2.onto_path.append(str(tmp_path))
    world = owlready2.World()
    world.get_ontology((tmp_path / "ugv.nt").as_uri()).load()
    knowledge = metaplan.kb.load(world)
    expected = metaplan.reason(UGV, fail=["c_kinect"]).to_dict()
    found = knowledge.reason(fail=["c_kinect"]).to_dict()
    assert {own["name"]: own["available"] for own in found["designs"]} == {
        own["name"]: own["available"] for own in expected["designs"]
    }
    knowledge.into(world, fail=["c_kinect"])
    design = rdflib.URIRef("http://metacontrol.org/metaplan/ugv#fd_amcl_kinect")
    facts = list(world.as_rdflib_graph().objects(design, rdflib.URIRef(TOMASYS + "fd_realisability")))
    assert [str(fact).lower() for fact in facts] == ["false"]


def test_owlready2_worlds_that_are_joined_keep_their_axioms():
    owlready2 = pytest.importorskip("owlready2", reason="owlready2 is not there")
    worlds, ontologies = [], []
    for name in ("one", "two"):
        worlds.append(owlready2.World())
        ontologies.append(worlds[-1].get_ontology(f"http://e/{name}#"))
        with ontologies[-1]:
            concept = type("A", (owlready2.Thing,), {})
            role = type("p", (owlready2.ObjectProperty,), {})
            concept.is_a.append(role.only(concept) if name == "one" else role.some(concept))
    expected = sum((read_back(world) for world in worlds), rdflib.Graph())
    for sources in (worlds, [*worlds, ontologies[0]], [worlds[0], worlds[1].as_rdflib_graph()]):
        joined = metaplan.kb.load(dict(enumerate(sources)))
        assert isomorphic(rdflib.Graph().parse(joined.path), expected)
        assert joined.path.read_bytes() == metaplan.kb.load(dict(enumerate(sources))).path.read_bytes()


def read_back(world):
    """Returns the document of a single world. Reading it gives all blank nodes new names."""
    knowledge = metaplan.kb.load(world)
    return rdflib.Graph().parse(knowledge.path)


def test_a_restored_knowledge_base_does_not_overwrite_its_file(tmp_path):
    path = tmp_path / "kb.nt"
    graph = rdflib.Graph().parse(data="<http://e/a> <http://e/p> _:b .", format="nt")
    pickled = pickle.dumps(metaplan.kb.load(graph, path))
    written = path.read_bytes()
    assert pickle.loads(pickled).path == path
    assert path.read_bytes() == written
    path.write_text("<http://e/c> <http://e/p> <http://e/d> .\n")
    pickle.loads(pickled)
    assert path.read_text().startswith("<http://e/c>")
    path.unlink()
    pickle.loads(pickled)
    assert path.read_bytes() == written
