//! Test of the language of comments and documents: counts discouraged phrases and names (see CONTRIBUTING.md), with a ceiling per folder.
//!
//! A ceiling is the best figure that a folder has reached. It may be lowered, but not raised.

use std::path::Path;

use regex::Regex;

const PHRASES: [&str; 10] = [
    r"\bso (many|much|long|often|far|few)\b",
    r"\bst(and|ands|ood|anding) (in|for|at|behind|alone|beside|there|below|between|under|before|by|on|where|as|apart|together)\b",
    r"\b(is|are|was|were|be|been|being) (looked (at|for|closer)|gone (through|on|by)|told|asked|spoken|heard|held against|taken (over|in|for|apart|away)|seen to|put off|given up)\b",
    r"\b(anew|for ever|otherwise than|beforehand|besides?)\b",
    r"\b(what|that|is|are) left\b",
    r"\b([Ss]omebody|[Aa]nybody|[Nn]obody|[Ww]hoever)\b",
    r"\b(is|are|was|be|than|there) none\b|; none (if|where|of)\b|\bNone (if|where)\b",
    r"\b(come|comes|came|coming) to\b",
    r"\b(come|comes|became|become|becomes) of\b",
    r"\bdear(er|est)?\b",
];

const FIRST_WORDS: &str =
    r"^(What|Who|Whose|How|Where|Which|When|Why|That|Those|So|As|Of|From|The same|None|Not)\b";

const VARIABLES: &str = r"\blet (?:mut )?(?:own|found|all|known|rest|left|others?|most|asked|told|said|seen|gone|made|given|taken|wanted|needed|such|those|these|both|many|few|same|more|less|ones?|none|that|this|what|which|who|lacks|meant|held|kept|put|shown|heard)\b";

struct Ceiling {
    folder: &'static str,
    /// Discouraged phrases per 10,000 words of comments.
    phrases: u64,
    /// Doc comments with discouraged first words, per 1,000.
    first_words: u64,
    /// `let` bindings with discouraged names, per 1,000.
    variables: u64,
}

const fn ceiling(folder: &'static str, phrases: u64, first_words: u64, variables: u64) -> Ceiling {
    Ceiling { folder, phrases, first_words, variables }
}

const CEILINGS: [Ceiling; 17] = [
    ceiling("rules/src/", 2, 0, 5),
    ceiling("ontology/src/", 1, 0, 5),
    ceiling("encodings/src/", 0, 4, 3),
    ceiling("crates/certificate/src/", 0, 0, 7),
    ceiling("crates/mission/src/", 0, 3, 6),
    ceiling("crates/pddl/src/", 0, 0, 2),
    ceiling("crates/picture/src/", 0, 0, 0),
    ceiling("crates/planner/src/", 0, 5, 3),
    ceiling("crates/probabilistic/src/", 0, 1, 4),
    ceiling("crates/search/src/", 0, 0, 8),
    ceiling("crates/task/src/", 0, 0, 2),
    ceiling("crates/temporal/src/", 0, 0, 5),
    ceiling("crates/verify/src/", 0, 0, 0),
    ceiling("integrations/ros/src/", 1, 2, 0),
    ceiling("integrations/fleet/src/", 0, 0, 0),
    ceiling("src/", 4, 4, 0),
    ceiling("tests/", 0, 2, 3),
];

/// Upper limit on discouraged phrases per 10,000 words in Markdown files.
const MARKDOWN_CEILING: u64 = 6;

#[derive(Debug, Default)]
struct Counts {
    words: u64,
    phrases: u64,
    docs: u64,
    first_words: u64,
    lets: u64,
    variables: u64,
}

struct Patterns {
    phrases: Vec<Regex>,
    first_words: Regex,
    variables: Regex,
    let_binding: Regex,
    word: Regex,
    code: Regex,
}

impl Patterns {
    fn new() -> Self {
        let pattern = |text: &str| Regex::new(text).expect("a pattern");
        Self {
            phrases: PHRASES.map(pattern).into(),
            first_words: pattern(FIRST_WORDS),
            variables: pattern(VARIABLES),
            let_binding: pattern(r"\blet (?:mut )?[a-z_]+\b"),
            word: pattern(r"[A-Za-z][A-Za-z'-]*"),
            code: pattern(r"(?s)```.*?```|`[^`]*`"),
        }
    }

    fn count_prose(&self, prose: &str, counts: &mut Counts) {
        // Code in backticks and in fenced blocks is not prose.
        let prose = self.code.replace_all(prose, " ");
        counts.words += self.word.find_iter(&prose).count() as u64;
        let occurrences = |phrase: &Regex| phrase.find_iter(&prose).count() as u64;
        counts.phrases += self.phrases.iter().map(occurrences).sum::<u64>();
    }

    /// Counts comments and variables of a Rust file. Only the first line of a doc comment is checked for
    /// discouraged first words.
    fn count_rust(&self, text: &str, counts: &mut Counts) {
        let mut prose = String::new();
        let mut is_inside_doc = false;
        for line in text.lines().map(str::trim_start) {
            let doc = line.strip_prefix("///");
            if let Some(sentence) = doc.filter(|_| !is_inside_doc) {
                counts.docs += 1;
                counts.first_words += u64::from(self.first_words.is_match(sentence.trim_start()));
            }
            is_inside_doc = doc.is_some();
            if line.starts_with("//") {
                prose += line.trim_start_matches(['/', '!']);
                prose.push('\n');
            }
        }
        self.count_prose(&prose, counts);
        counts.lets += self.let_binding.find_iter(text).count() as u64;
        counts.variables += self.variables.find_iter(text).count() as u64;
    }
}

fn rate(part: u64, whole: u64, base: u64) -> u64 {
    (part * base).div_ceil(whole.max(1))
}

#[test]
fn comments_and_names_stay_below_the_ceilings() {
    let patterns = Patterns::new();
    let files = super::files();
    let mut excess = Vec::new();
    for Ceiling { folder, phrases, first_words, variables } in CEILINGS {
        let mut counts = Counts::default();
        for (_, text) in files.iter().filter(|(path, _)| path.starts_with(folder)) {
            patterns.count_rust(text, &mut counts);
        }
        assert!(counts.words > 0, "{folder} has no comments");
        let rates = (
            rate(counts.phrases, counts.words, 10_000),
            rate(counts.first_words, counts.docs, 1_000),
            rate(counts.variables, counts.lets, 1_000),
        );
        if rates.0 > phrases || rates.1 > first_words || rates.2 > variables {
            excess.push(format!("ceiling(\"{folder}\", {}, {}, {}),", rates.0, rates.1, rates.2));
        }
    }
    assert!(excess.is_empty(), "above the ceiling (phrases, first words, variables):\n{}", excess.join("\n"));
}

#[test]
fn markdown_stays_below_its_ceiling() {
    let patterns = Patterns::new();
    let mut counts = Counts::default();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for path in super::pages::pages(root) {
        let text = std::fs::read_to_string(root.join(path)).expect("text");
        patterns.count_prose(&text, &mut counts);
    }
    let phrase_rate = rate(counts.phrases, counts.words, 10_000);
    assert!(
        phrase_rate <= MARKDOWN_CEILING,
        "{phrase_rate} phrases per 10,000 words; the ceiling is {MARKDOWN_CEILING}"
    );
}

#[test]
fn phrases_names_and_first_words_are_counted() {
    let mut counts = Counts::default();
    let text = "/// What is left of it.\n/// Not so many words.\nfn f() {\n    let found = 1;\n    let plan = 2; // no prose\n}\n";
    Patterns::new().count_rust(text, &mut counts);
    assert_eq!((counts.docs, counts.first_words), (1, 1));
    assert_eq!((counts.lets, counts.variables), (2, 1));
    assert_eq!(counts.phrases, 2, "is left, so many");
    assert_eq!(counts.words, 9);
}
