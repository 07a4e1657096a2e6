"""Knowledge bases of other libraries: owlready2 worlds and rdflib graphs as input, inferred assertions as output.

>>> import metaplan.kb
>>> knowledge = metaplan.kb.load(world)  # an owlready2 world or ontology, or an rdflib graph
>>> mission = metaplan.Mission.from_files(domain, problem, [knowledge.path])
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import rdflib

from metaplan._answers import Answer
from metaplan._mission import reason

__all__ = ["Knowledge", "load"]


class Knowledge:
    """A knowledge base as a document that Metaplan reads.

    Without ``path`` the document is temporary. It is deleted with this object, so a pickled mission that uses it cannot be restored later.
    """

    def __init__(self, graph: rdflib.Graph, path: str | os.PathLike[str] | None = None) -> None:
        text = graph.serialize(format="nt", encoding="utf-8")
        self._open(path)
        # Sorted lines, so that equal graphs give equal documents.
        self.path.write_bytes(b"".join(sorted(text.splitlines(keepends=True))))

    def _open(self, path: str | os.PathLike[str] | None) -> None:
        """Sets the path; without ``path``, that of a new temporary document."""
        self._temporary = None
        if path is None:
            self._temporary = tempfile.TemporaryDirectory(prefix="metaplan-kb-")
            path = Path(self._temporary.name) / "knowledge.nt"
        self.path = Path(path)
        """Path of the document, in N-Triples."""

    def __fspath__(self) -> str:
        return os.fspath(self.path)

    def __reduce__(self) -> tuple[Callable[..., Knowledge], tuple[bytes, str | None]]:
        return _restored, (self.path.read_bytes(), None if self._temporary else os.fspath(self.path))

    def reason(self, **options: Any) -> Answer:
        """Queries the knowledge base; ``options`` are those of :func:`metaplan.reason`."""
        return reason(self.path, **options)

    def inferred(self, **options: Any) -> rdflib.Graph:
        """Returns the inferred assertions as a graph; ``options`` are those of :func:`metaplan.reason`."""
        graph = rdflib.Graph()
        graph.parse(data="\n".join(self.reason(**options).to_dict()["inferred"]), format="nt")
        return graph

    def into(self, world: Any, **options: Any) -> None:
        """Adds the inferred assertions to an owlready2 world; ``options`` are those of :func:`metaplan.reason`."""
        graph = world.as_rdflib_graph()
        with world.get_ontology("http://metaplan.invalid/inferred#"):
            for triple in self.inferred(**options):
                graph.add(triple)


def load(source: Any, path: str | os.PathLike[str] | None = None) -> Knowledge:
    """Reads an owlready2 world, the world of an owlready2 ontology, an rdflib graph, or a mapping of these.

    :param path: where to write the document; by default it is temporary
    """
    if isinstance(source, Mapping):
        joined = rdflib.Graph()
        worlds: list[Any] = []
        for each in source.values():
            graph, world = _graph(each), _world(each)
            if world is not None:
                if world not in worlds:
                    worlds.append(world)
                graph = _renamed(graph, f"world{worlds.index(world)}_")
            joined += graph
        return Knowledge(joined, path)
    return Knowledge(_graph(source), path)


def _restored(document: bytes, path: str | None) -> Knowledge:
    """Recreates a knowledge base that was pickled. A file that is still there may have been changed since, so it is not overwritten."""
    knowledge = Knowledge.__new__(Knowledge)
    knowledge._open(path)
    if not knowledge.path.exists():
        knowledge.path.write_bytes(document)
    return knowledge


def _world(source: Any) -> Any:
    """Returns the owlready2 world of a world, an ontology or a graph of them; ``None`` for other graphs."""
    if isinstance(source, rdflib.Graph) and not hasattr(source, "world"):
        return getattr(source.store, "world", None)
    return getattr(source, "world", source)


def _renamed(graph: rdflib.Graph, prefix: str) -> rdflib.Graph:
    """Returns a copy with a prefix before the names of blank nodes, because each owlready2 world numbers them from 1."""
    renamed = rdflib.Graph()
    for triple in graph:
        subject, predicate, value = (rdflib.BNode(prefix + node) if isinstance(node, rdflib.BNode) else node for node in triple)
        renamed.add((subject, predicate, value))
    return renamed


def _graph(source: Any) -> rdflib.Graph:
    if isinstance(source, rdflib.Graph) and not hasattr(source, "world"):
        return source
    world = getattr(source, "world", source)
    plain = rdflib.Graph()
    for triple in world.as_rdflib_graph():
        plain.add(triple)
    return plain
