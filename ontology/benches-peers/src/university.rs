//! Generates universities in the shape and proportions of the Lehigh University Benchmark [1]: departments with
//! professors, students, courses and publications, and a schema with class and property hierarchies, inverses,
//! a transitive property, domains, ranges, and classes defined by intersections with existential restrictions.
//!
//! [1] Guo, Pan, Heflin: LUBM: A benchmark for OWL knowledge base systems, J. Web Semantics 2005.

use crate::Random;

const NS: &str = "http://example.org/univ#";
const RDF: &str = "http://www.w3.org/1999/02/22-rdf-syntax-ns#";
const RDFS: &str = "http://www.w3.org/2000/01/rdf-schema#";
const OWL: &str = "http://www.w3.org/2002/07/owl#";

const CLASSES: [(&str, &str); 34] = [
    ("AdministrativeStaff", "Employee"),
    ("Article", "Publication"),
    ("AssistantProfessor", "Professor"),
    ("AssociateProfessor", "Professor"),
    ("Book", "Publication"),
    ("Chair", "Professor"),
    ("ClericalStaff", "AdministrativeStaff"),
    ("College", "Organization"),
    ("ConferencePaper", "Article"),
    ("Course", "Work"),
    ("Dean", "Professor"),
    ("Department", "Organization"),
    ("Faculty", "Employee"),
    ("FullProfessor", "Professor"),
    ("GraduateCourse", "Course"),
    ("GraduateStudent", "Person"),
    ("Institute", "Organization"),
    ("JournalArticle", "Article"),
    ("Lecturer", "Faculty"),
    ("Manual", "Publication"),
    ("PostDoc", "Faculty"),
    ("Professor", "Faculty"),
    ("Program", "Organization"),
    ("Research", "Work"),
    ("ResearchAssistant", "Student"),
    ("ResearchGroup", "Organization"),
    ("Software", "Publication"),
    ("Specification", "Publication"),
    ("SystemsStaff", "AdministrativeStaff"),
    ("TechnicalReport", "Article"),
    ("UndergraduateStudent", "Student"),
    ("University", "Organization"),
    ("UnofficialPublication", "Publication"),
    ("VisitingProfessor", "Professor"),
];

/// Classes of persons with a property value in a class: class, property, filler.
const DEFINED: [(&str, &str, &str); 6] = [
    ("Chair", "headOf", "Department"),
    ("Dean", "headOf", "College"),
    ("Director", "headOf", "Program"),
    ("Employee", "worksFor", "Organization"),
    ("Student", "takesCourse", "Course"),
    ("TeachingAssistant", "teachingAssistantOf", "Course"),
];

const PROPERTIES: [(&str, &str, &str); 17] = [
    ("advisor", "Person", "Professor"),
    ("degreeFrom", "Person", "University"),
    ("doctoralDegreeFrom", "Person", "University"),
    ("hasAlumnus", "University", "Person"),
    ("headOf", "", ""),
    ("mastersDegreeFrom", "Person", "University"),
    ("member", "Organization", "Person"),
    ("memberOf", "", ""),
    ("orgPublication", "Organization", "Publication"),
    ("publicationAuthor", "Publication", "Person"),
    ("researchProject", "ResearchGroup", "Research"),
    ("subOrganizationOf", "Organization", "Organization"),
    ("takesCourse", "", ""),
    ("teacherOf", "Faculty", "Course"),
    ("teachingAssistantOf", "TeachingAssistant", "Course"),
    ("undergraduateDegreeFrom", "Person", "University"),
    ("worksFor", "", ""),
];

const DATA: [&str; 4] = ["name", "emailAddress", "telephone", "researchInterest"];

const SUB_PROPERTIES: [(&str, &str); 5] = [
    ("doctoralDegreeFrom", "degreeFrom"),
    ("mastersDegreeFrom", "degreeFrom"),
    ("undergraduateDegreeFrom", "degreeFrom"),
    ("headOf", "worksFor"),
    ("worksFor", "memberOf"),
];

#[derive(Clone)]
pub enum Object {
    Iri(String),
    Text(String),
    Blank(String),
}

/// Subject (an IRI or a blank node), predicate, object.
pub type Triple = (String, String, Object);

fn iri(name: &str) -> String {
    format!("{NS}{name}")
}

pub fn schema() -> Vec<Triple> {
    let mut triples = Vec::new();
    let mut add = |subject: &str, predicate: &str, object: Object| {
        triples.push((subject.to_owned(), predicate.to_owned(), object));
    };
    let named = |name: &str| Object::Iri(iri(name));
    let kind = format!("{RDF}type");
    add("http://example.org/univ", &kind, Object::Iri(format!("{OWL}Ontology")));
    let classes = CLASSES.iter().map(|(class, _)| *class).chain(DEFINED.iter().map(|(class, ..)| *class));
    for class in classes.chain(["Person", "Organization", "Publication", "Work"]) {
        add(&iri(class), &kind, Object::Iri(format!("{OWL}Class")));
    }
    for (class, superclass) in CLASSES {
        add(&iri(class), &format!("{RDFS}subClassOf"), named(superclass));
    }
    for (class, property, filler) in DEFINED {
        let [whole, list, tail, restriction] = ["c", "l", "m", "r"].map(|kind| format!("_:{kind}{class}"));
        let blank = |name: &str| Object::Blank(name.to_owned());
        add(&iri(class), &format!("{OWL}equivalentClass"), blank(&whole));
        add(&whole, &kind, Object::Iri(format!("{OWL}Class")));
        add(&whole, &format!("{OWL}intersectionOf"), blank(&list));
        add(&list, &format!("{RDF}first"), named("Person"));
        add(&list, &format!("{RDF}rest"), blank(&tail));
        add(&tail, &format!("{RDF}first"), blank(&restriction));
        add(&tail, &format!("{RDF}rest"), Object::Iri(format!("{RDF}nil")));
        add(&restriction, &kind, Object::Iri(format!("{OWL}Restriction")));
        add(&restriction, &format!("{OWL}onProperty"), named(property));
        add(&restriction, &format!("{OWL}someValuesFrom"), named(filler));
    }
    for (property, domain, range) in PROPERTIES {
        add(&iri(property), &kind, Object::Iri(format!("{OWL}ObjectProperty")));
        for (term, class) in [("domain", domain), ("range", range)] {
            if !class.is_empty() {
                add(&iri(property), &format!("{RDFS}{term}"), named(class));
            }
        }
    }
    for property in DATA {
        add(&iri(property), &kind, Object::Iri(format!("{OWL}DatatypeProperty")));
    }
    for (property, superproperty) in SUB_PROPERTIES {
        add(&iri(property), &format!("{RDFS}subPropertyOf"), named(superproperty));
    }
    add(&iri("degreeFrom"), &format!("{OWL}inverseOf"), named("hasAlumnus"));
    add(&iri("memberOf"), &format!("{OWL}inverseOf"), named("member"));
    add(&iri("subOrganizationOf"), &kind, Object::Iri(format!("{OWL}TransitiveProperty")));
    triples
}

struct Department<'r> {
    place: String,
    random: &'r mut Random,
    triples: Vec<Triple>,
}

impl Department<'_> {
    fn local(&self, kind: &str, number: u32) -> String {
        format!("{}/{kind}{number}", self.place)
    }

    fn is(&mut self, subject: &str, class: &str) {
        self.triples.push((subject.to_owned(), format!("{RDF}type"), Object::Iri(iri(class))));
    }

    fn relate(&mut self, subject: &str, property: &str, object: &str) {
        self.triples.push((subject.to_owned(), iri(property), Object::Iri(object.to_owned())));
    }

    fn text(&mut self, subject: &str, property: &str, text: String) {
        self.triples.push((subject.to_owned(), iri(property), Object::Text(text)));
    }

    fn named(&mut self, kind: &str, number: u32) -> String {
        let subject = self.local(kind, number);
        self.is(&subject, kind);
        self.text(&subject, "name", format!("{kind}{number}"));
        subject
    }

    fn contact(&mut self, person: &str) {
        self.text(person, "emailAddress", format!("{}@example.org", person.trim_start_matches("http://")));
        self.text(person, "telephone", "xxx-xxx-xxxx".to_owned());
    }

    fn degree(&mut self, person: &str, property: &str) {
        let university = format!("http://www.University{}.example.org", self.random.below(1000));
        self.is(&university, "University");
        self.relate(person, property, &university);
    }

    fn faculty(&mut self) -> Vec<String> {
        let mut members = Vec::new();
        let (mut course, mut graduate) = (0, 0);
        for (kind, count) in
            [("FullProfessor", 10), ("AssociateProfessor", 14), ("AssistantProfessor", 10), ("Lecturer", 7)]
        {
            for number in 0..count {
                let person = self.named(kind, number);
                self.contact(&person);
                let place = self.place.clone();
                self.relate(&person, "worksFor", &place);
                for degree in ["undergraduateDegreeFrom", "mastersDegreeFrom", "doctoralDegreeFrom"] {
                    self.degree(&person, degree);
                }
                let interest = self.random.below(30);
                self.text(&person, "researchInterest", format!("Research{interest}"));
                for _ in 0..=self.random.below(2) {
                    let subject = self.named("Course", course);
                    course += 1;
                    self.relate(&person, "teacherOf", &subject);
                }
                for _ in 0..=self.random.below(2) {
                    let subject = self.named("GraduateCourse", graduate);
                    graduate += 1;
                    self.relate(&person, "teacherOf", &subject);
                }
                members.push(person);
            }
        }
        let (head, place) = (members[0].clone(), self.place.clone());
        self.relate(&head, "headOf", &place);
        members
    }

    fn students(&mut self, professors: &[String]) -> Vec<String> {
        let mut graduates = Vec::new();
        let place = self.place.clone();
        for (kind, count, course, courses) in
            [("UndergraduateStudent", 532, "Course", 60), ("GraduateStudent", 146, "GraduateCourse", 60)]
        {
            for number in 0..count {
                let person = self.named(kind, number);
                self.contact(&person);
                self.relate(&person, "memberOf", &place);
                for _ in 0..2 + self.random.below(3) {
                    let course_taken = self.random.below(courses);
                    let course_taken = self.local(course, course_taken);
                    self.relate(&person, "takesCourse", &course_taken);
                }
                let has_advisor = kind == "GraduateStudent" || number % 5 == 0;
                if has_advisor {
                    let advisor = self.random.below(34) as usize;
                    self.relate(&person, "advisor", &professors[advisor]);
                }
                if kind == "GraduateStudent" {
                    self.degree(&person, "undergraduateDegreeFrom");
                    match number % 5 {
                        0 => {
                            let course_taught = self.random.below(60);
                            let course_taught = self.local("Course", course_taught);
                            self.is(&person, "TeachingAssistant");
                            self.relate(&person, "teachingAssistantOf", &course_taught);
                        }
                        1 => self.is(&person, "ResearchAssistant"),
                        _ => {}
                    }
                    graduates.push(person);
                }
            }
        }
        graduates
    }

    fn publications(&mut self, professors: &[String], graduates: &[String]) {
        for number in 0..460 {
            let publication = self.named("Publication", number);
            let author = self.random.below(professors.len() as u32) as usize;
            self.relate(&publication, "publicationAuthor", &professors[author]);
            if self.random.below(5) < 4 {
                let author = self.random.below(graduates.len() as u32) as usize;
                self.relate(&publication, "publicationAuthor", &graduates[author]);
            }
        }
    }
}

pub fn department(university: u32, number: u32, random: &mut Random) -> Vec<Triple> {
    let whole = format!("http://www.University{university}.example.org");
    let place = format!("http://www.Department{number}.University{university}.example.org");
    let mut department = Department { place: place.clone(), random, triples: Vec::new() };
    department.is(&whole, "University");
    department.is(&place, "Department");
    department.text(&place, "name", format!("Department{number}"));
    department.relate(&place, "subOrganizationOf", &whole);
    for group in 0..10 {
        let group = department.local("ResearchGroup", group);
        department.is(&group, "ResearchGroup");
        department.relate(&group, "subOrganizationOf", &place);
    }
    let professors = department.faculty();
    let graduates = department.students(&professors);
    department.publications(&professors, &graduates);
    department.triples
}

/// Generates universities. The first document is the schema, each other one a department. Five universities
/// have about 625,000 triples.
pub fn universities(count: u32) -> Vec<Vec<Triple>> {
    let mut random = Random(1);
    let mut documents = vec![schema()];
    for university in 0..count {
        let departments = 14 + university % 2;
        documents.extend((0..departments).map(|number| department(university, number, &mut random)));
    }
    documents
}

pub fn ntriples(triples: &[Triple]) -> String {
    let mut text = String::new();
    for (subject, predicate, object) in triples {
        match subject.strip_prefix("_:") {
            Some(_) => text += subject,
            None => text += &format!("<{subject}>"),
        }
        text += &match object {
            Object::Iri(iri) => format!(" <{predicate}> <{iri}> .\n"),
            Object::Text(value) => format!(" <{predicate}> \"{value}\" .\n"),
            Object::Blank(name) => format!(" <{predicate}> {name} .\n"),
        };
    }
    text
}

pub fn rdf_xml(triples: &[Triple]) -> String {
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n<rdf:RDF xmlns:rdf=\"{RDF}\" xmlns:rdfs=\"{RDFS}\" xmlns:owl=\"{OWL}\" xmlns:u=\"{NS}\">\n"
    );
    for (subject, predicate, object) in triples {
        let about = match subject.strip_prefix("_:") {
            Some(name) => format!("rdf:nodeID=\"{name}\""),
            None => format!("rdf:about=\"{subject}\""),
        };
        let short = [("rdf", RDF), ("rdfs", RDFS), ("owl", OWL), ("u", NS)];
        let name =
            short.iter().find_map(|(prefix, iri)| Some(format!("{prefix}:{}", predicate.strip_prefix(iri)?)));
        let name = name.unwrap_or_default();
        let content = match object {
            Object::Iri(iri) => format!("<{name} rdf:resource=\"{iri}\"/>"),
            Object::Blank(node) => format!("<{name} rdf:nodeID=\"{}\"/>", node.trim_start_matches("_:")),
            Object::Text(value) => format!("<{name}>{value}</{name}>"),
        };
        text += &format!("<rdf:Description {about}>{content}</rdf:Description>\n");
    }
    text + "</rdf:RDF>\n"
}
