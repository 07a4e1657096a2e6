//! Generated ontologies in Turtle, each with one kind of axiom: hierarchies, restrictions, properties,
//! equality.

use std::fmt::Write;

use crate::Random;

const HEAD: &str = "@prefix : <http://example.org/shape#> .\n@prefix owl: <http://www.w3.org/2002/07/owl#> .\n\
    @prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .\n\
    @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .\n";

fn text(make: impl FnOnce(&mut String, &mut Random)) -> String {
    let mut text = HEAD.to_owned();
    make(&mut text, &mut Random(7));
    text
}

macro_rules! line {
    ($text:expr, $($format:tt)*) => {
        let _ = writeln!($text, $($format)*);
    };
}

pub fn all() -> Vec<(&'static str, String)> {
    vec![
        ("a deep hierarchy", text(deep)),
        ("a wide hierarchy", text(wide)),
        ("equivalent classes", text(equivalent)),
        ("intersections", text(intersections)),
        ("unions", text(unions)),
        ("values from classes", text(values)),
        ("fixed values", text(fixed)),
        ("disjoint classes", text(disjoint)),
        ("property hierarchies", text(properties)),
        ("inverses and symmetry", text(inverses)),
        ("a transitive tree", text(tree)),
        ("domains and ranges", text(domains)),
        ("functional properties", text(functional)),
        ("enumerations", text(enumerations)),
    ]
}

fn deep(text: &mut String, random: &mut Random) {
    for class in 1..60 {
        line!(text, ":C{class} a owl:Class ; rdfs:subClassOf :C{} .", class - 1);
    }
    for individual in 0..2_000 {
        line!(text, ":i{individual} a :C{} .", random.below(60));
    }
}

fn wide(text: &mut String, random: &mut Random) {
    for class in 1..3_000 {
        line!(text, ":C{class} a owl:Class ; rdfs:subClassOf :C{} .", class / 4);
    }
    for individual in 0..10_000 {
        line!(text, ":i{individual} a :C{} .", random.below(3_000));
    }
}

fn equivalent(text: &mut String, random: &mut Random) {
    for class in 0..500 {
        line!(text, ":C{class} a owl:Class ; owl:equivalentClass :C{} .", class / 5 * 5);
    }
    for individual in 0..10_000 {
        line!(text, ":i{individual} a :C{} .", random.below(500));
    }
}

fn intersections(text: &mut String, random: &mut Random) {
    for class in 0..200 {
        let [first, second] = [random.below(20), random.below(20)];
        line!(
            text,
            ":D{class} a owl:Class ; owl:equivalentClass [ a owl:Class ; owl:intersectionOf ( :C{first} :C{second} ) ] ."
        );
    }
    for individual in 0..10_000 {
        line!(text, ":i{individual} a :C{} , :C{} .", random.below(20), random.below(20));
    }
}

fn unions(text: &mut String, random: &mut Random) {
    for class in 0..200 {
        let [first, second] = [random.below(100), random.below(100)];
        line!(
            text,
            ":D{class} a owl:Class ; owl:equivalentClass [ a owl:Class ; owl:unionOf ( :C{first} :C{second} ) ] ."
        );
    }
    for individual in 0..10_000 {
        line!(text, ":i{individual} a :C{} .", random.below(100));
    }
}

fn values(text: &mut String, random: &mut Random) {
    for property in 0..20 {
        line!(text, ":p{property} a owl:ObjectProperty .");
        line!(
            text,
            ":S{property} a owl:Class ; owl:equivalentClass [ a owl:Restriction ; owl:onProperty :p{property} ; owl:someValuesFrom :C{property} ] ."
        );
        line!(
            text,
            ":A{property} a owl:Class ; rdfs:subClassOf [ a owl:Restriction ; owl:onProperty :p{property} ; owl:allValuesFrom :D{property} ] ."
        );
    }
    for individual in 0..10_000 {
        let [property, class, other] = [random.below(20), random.below(20), random.below(10_000)];
        line!(text, ":i{individual} a :C{class} , :A{property} ; :p{property} :i{other} .");
    }
}

fn fixed(text: &mut String, random: &mut Random) {
    for class in 0..100 {
        line!(
            text,
            ":p{class} a owl:ObjectProperty . :H{class} a owl:Class ; owl:equivalentClass [ a owl:Restriction ; owl:onProperty :p{class} ; owl:hasValue :v{class} ] ."
        );
    }
    for individual in 0..20_000 {
        let class = random.below(100);
        if individual % 2 == 0 {
            line!(text, ":i{individual} a :H{class} .");
        } else {
            line!(text, ":i{individual} :p{class} :v{class} .");
        }
    }
}

fn disjoint(text: &mut String, random: &mut Random) {
    for class in 0..200 {
        line!(
            text,
            ":C{class} a owl:Class ; rdfs:subClassOf :P{} ; owl:disjointWith :C{} .",
            class / 10,
            (class + 1) % 200
        );
    }
    for individual in 0..20_000 {
        line!(text, ":i{individual} a :C{} .", random.below(200));
    }
}

fn properties(text: &mut String, random: &mut Random) {
    for property in 1..100 {
        line!(text, ":p{property} a owl:ObjectProperty ; rdfs:subPropertyOf :p{} .", property / 3);
    }
    for _ in 0..20_000 {
        let [from, property, to] = [random.below(5_000), random.below(100), random.below(5_000)];
        line!(text, ":i{from} :p{property} :i{to} .");
    }
}

fn inverses(text: &mut String, random: &mut Random) {
    for property in 0..10 {
        line!(
            text,
            ":p{property} a owl:ObjectProperty ; owl:inverseOf :q{property} . :s{property} a owl:SymmetricProperty , owl:ObjectProperty ."
        );
    }
    for _ in 0..15_000 {
        let [from, property, to] = [random.below(5_000), random.below(10), random.below(5_000)];
        line!(text, ":i{from} :p{property} :i{to} ; :s{property} :i{to} .");
    }
}

fn tree(text: &mut String, _: &mut Random) {
    line!(text, ":part a owl:TransitiveProperty , owl:ObjectProperty .");
    for individual in 1..8_000 {
        line!(text, ":i{individual} :part :i{} .", individual / 2);
    }
}

fn domains(text: &mut String, random: &mut Random) {
    for property in 0..50 {
        line!(
            text,
            ":p{property} a owl:ObjectProperty ; rdfs:domain :D{property} ; rdfs:range :R{property} ."
        );
    }
    for _ in 0..20_000 {
        let [from, property, to] = [random.below(5_000), random.below(50), random.below(5_000)];
        line!(text, ":i{from} :p{property} :i{to} .");
    }
}

fn functional(text: &mut String, random: &mut Random) {
    line!(text, ":of a owl:FunctionalProperty , owl:ObjectProperty .");
    for individual in 0..4_000 {
        line!(
            text,
            ":i{individual} :of :a{individual} , :b{individual} . :a{individual} a :A . :b{individual} :near :i{} .",
            random.below(4_000)
        );
    }
}

fn enumerations(text: &mut String, random: &mut Random) {
    for class in 0..100 {
        let members: Vec<String> = (0..20).map(|_| format!(":i{}", random.below(5_000))).collect();
        line!(
            text,
            ":E{class} a owl:Class ; owl:oneOf ( {} ) ; rdfs:subClassOf :C{} .",
            members.join(" "),
            class % 10
        );
    }
    for individual in 0..5_000 {
        line!(text, ":i{individual} :near :i{} .", random.below(5_000));
    }
}
