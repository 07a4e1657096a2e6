//! The cache of module behaviours does not change results: random models are explored with and
//! without the cache, and yield the same process or the same error. Copies of tables of states use little memory.

use std::fmt::Write as _;

use metaplan_probabilistic::explore::{Bounds, Choices, Explored, Generator, explore};
use metaplan_probabilistic::prism::{self, Packed, Program, Remembered, Settings};
use metaplan_probabilistic::{BigRational, Error, Number};

struct Random(u64);

impl Random {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % bound
    }

    fn one_of<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[usize::try_from(self.below(of.len() as u64)).expect("small")]
    }
}

fn guard(random: &mut Random, module: u64, modules: u64) -> String {
    let other = random.below(modules);
    match random.below(6) {
        0 => format!("a{module}={}", random.below(4)),
        1 => format!("a{module}<{} & !(b{other})", random.below(5)),
        2 => format!("a{module}!=a{other} | b{module}"),
        3 => format!("mod(a{module}+a{other}, {})=0", random.below(3) + 1),
        4 => format!("g<{}", random.below(4)),
        _ => "true".to_owned(),
    }
}

fn assignment(random: &mut Random, module: u64, modules: u64, global: bool) -> String {
    let other = random.below(modules);
    match random.below(if global { 6 } else { 5 }) {
        0 => format!("(a{module}'=min(3, a{module}+1))"),
        1 => format!("(a{module}'=mod(a{module}+a{other}, 4)) & (b{module}'=!b{module})"),
        2 => format!("(a{module}'={})", random.below(4)),
        // The assignment may leave the range of the variable.
        3 if random.below(12) == 0 => format!("(a{module}'=a{module}+1)"),
        5 => "(g'=mod(g+1, 3))".to_owned(),
        _ => "true".to_owned(),
    }
}

fn command(random: &mut Random, module: u64, modules: u64) -> String {
    let action = random.one_of(&["", "", "x", "y", "z"]);
    let mut update = || assignment(random, module, modules, action.is_empty());
    let (first, second) = (update(), update());
    let updates = match random.below(4) {
        0 => format!("1/3 : {first} + 2/3 : {second}"),
        1 => format!("a{module}/4 : {first} + 1-a{module}/4 : {second}"),
        _ => first,
    };
    format!("  [{action}] {} -> {updates};\n", guard(random, module, modules))
}

/// Creates a model of one to four modules. Some models have variables of many bits, so that the
/// cache uses a hash map or is not used.
fn model(random: &mut Random) -> String {
    let modules = random.below(4) + 1;
    let mut text = format!("{}\nglobal g : [0..3];\n", random.one_of(&["mdp", "dtmc"]));
    let wide = random.below(3) == 0;
    for module in 0..modules {
        let _ = write!(text, "module m{module}\n  a{module} : [0..3];\n  b{module} : bool;\n");
        if wide {
            let other = random.below(modules);
            let _ = write!(text, "  c{module} : [0..{}];\n  [] c{module}+c{other}>0 -> true;\n", 1_u64 << 40);
        }
        for _ in 0..=random.below(5) {
            text += &command(random, module, modules);
        }
        text += "endmodule\n";
    }
    text += "rewards\n  a0=1 : 2;\n  [x] b0 : a0+1/2;\n  [] true : 1/3;\nendrewards\n";
    text
}

fn shown<N: Number>(result: Result<Explored<Packed, N>, Error>) -> String {
    match result {
        Ok(Explored { mdp, starts, states, rewards, deadlocks, .. }) => {
            let states: Vec<_> = states.iter().collect();
            format!("{mdp:?} {starts} {states:?} {rewards:?} {deadlocks}")
        }
        Err(error) => format!("{error:?}"),
    }
}

fn agree<N: Number>(text: &str) {
    let model = prism::parse(text).expect("it reads");
    let program = Program::<N>::new(&model, &Settings::new()).expect("names are right").with_rewards(&[0]);
    let bounds = Bounds::default().with_states(3000);
    let plain = shown(explore(&program, &bounds));
    let remembered = shown(explore(&Remembered::new(&program), &bounds));
    // With the cache, the state limit may be detected a few states later.
    if !plain.starts_with("StateLimit") || !remembered.starts_with("StateLimit") {
        assert_eq!(plain, remembered, "{text}");
    }
}

#[test]
fn random_models_are_explored_to_the_same_process() {
    for seed in 0..500 {
        let text = model(&mut Random(seed));
        agree::<f64>(&text);
        if seed % 5 == 0 {
            agree::<BigRational>(&text);
        }
    }
}

#[test]
fn behaviours_beyond_the_cache_limit_are_recomputed() {
    let text = "mdp
module m  x : [0..99999] init 0;  [] x<99999 -> 1/2 : (x'=x+1) + 1/2 : true;  [x] x=99999 -> (x'=0); endmodule
module n  y : [0..1];  [] mod(x, 2)=0 & x>99990 -> (y'=1-y);  [x] true -> true; endmodule
rewards [x] x>0 : x; [] true : x; endrewards";
    let model = prism::parse(text).expect("it reads");
    let program = Program::<f64>::new(&model, &Settings::new()).expect("names are right").with_rewards(&[0]);
    let plain = shown(explore(&program, &Bounds::default()));
    assert!(plain == shown(explore(&Remembered::new(&program), &Bounds::default())), "they differ");
}

/// A chain whose state codes are far apart.
struct Sparse;

const STATES: usize = 64;

impl Generator<f64> for Sparse {
    type State = usize;

    fn initial(&self) -> usize {
        0
    }

    fn rewards(&self) -> usize {
        0
    }

    fn codes(&self) -> Option<usize> {
        Some(STATES << 20)
    }

    fn code(&self, state: &usize) -> usize {
        state << 20
    }

    fn successors(&self, state: &usize, choices: &mut Choices<usize, f64>) -> Result<(), Error> {
        choices.to((state + 1) % STATES, 1.0);
        choices.end(0, []);
        Ok(())
    }
}

/// Returns the resident memory of this process in pages, if the system reports it.
fn resident() -> Option<u64> {
    let statistics = std::fs::read_to_string("/proc/self/statm").ok()?;
    statistics.split_whitespace().nth(1)?.parse().ok()
}

#[test]
fn copies_of_sparse_tables_of_states_use_little_memory() {
    let states = explore(&Sparse, &Bounds::default()).expect("a chain").states;
    let before = resident();
    let copy = states.clone();
    if let (Some(before), Some(after)) = (before, resident()) {
        // The table has 65,536 pages of 4 kB. Other tests may run at the same time.
        assert!(after.saturating_sub(before) < 50_000, "from {before} to {after} pages");
    }
    for (number, state) in copy.iter().enumerate() {
        assert_eq!(copy.number(Sparse.code(state), state), Some(number));
    }
    assert_eq!((copy.len(), copy.number(1, &0)), (STATES, None));
}
