//! Damaged knowledge bases are read or rejected, and never stop the program.

use ontology::{ReadOptions, kb, lower, read_text};
use rules::Symbols;

/// A small generator of numbers (xorshift), the same on every machine.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % bound as u64) as usize
    }
}

/// Reads and lowers; true if the text was accepted.
fn survives(text: &str) -> bool {
    let Ok(ontology) = read_text(text, "damaged", &ReadOptions::default()) else { return false };
    lower(&ontology, &mut Symbols::new());
    true
}

#[test]
fn words_exchanged_at_random() {
    let words: Vec<&str> = kb::TOMASYS.split_inclusive(' ').collect();
    let mut numbers = Numbers(0x2545_F491_4F6C_DD1D);
    let mut accepted = 0;
    for _ in 0..300 {
        let mut damaged = words.clone();
        for _ in 0..=numbers.below(3) {
            let (from, to) = (numbers.below(words.len()), numbers.below(words.len()));
            damaged[to] = words[from];
        }
        accepted += usize::from(survives(&damaged.concat()));
    }
    assert!(accepted > 50, "{accepted} of 300 were still ontologies");
}

#[test]
fn texts_cut_off_anywhere() {
    for end in (0..kb::TOMASYS.len()).step_by(97) {
        if let Some(text) = kb::TOMASYS.get(..end) {
            survives(text);
        }
    }
}
