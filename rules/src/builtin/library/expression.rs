//! Parser and evaluator of arithmetic expressions in the syntax of the Java Math Expression Parser 2.4.
//!
//! The supported syntax consists of numbers, variables, the operators `+`, `-`, `*`, `/`, `%` and `^`, signs,
//! brackets, the constants `pi` and `e`, functions of one or two numbers, `sum` of any number of terms, and implicit
//! multiplication (`2x`, `3(a + b)`).

/// Maximum nesting depth of brackets, calls, signs and powers, which limits the recursion depth of the
/// parser. A bracket or a call counts twice, because its content starts with an optional sign.
const MAX_DEPTH: usize = 200;

pub(super) fn value(text: &str, variables: &[(&str, f64)]) -> Option<f64> {
    let mut parser = Parser { rest: text, variables, depth: 0 };
    let value = parser.sum()?;
    parser.rest.trim_start().is_empty().then_some(value)
}

struct Parser<'a> {
    rest: &'a str,
    variables: &'a [(&'a str, f64)],
    depth: usize,
}

impl<'a> Parser<'a> {
    fn peek(&mut self) -> Option<char> {
        self.rest = self.rest.trim_start();
        self.rest.chars().next()
    }

    fn accept(&mut self, wanted: char) -> bool {
        let is_next = self.peek() == Some(wanted);
        if is_next {
            self.rest = &self.rest[wanted.len_utf8()..];
        }
        is_next
    }

    fn take(&mut self, belongs: impl Fn(char) -> bool) -> &'a str {
        let end = self.rest.find(|c| !belongs(c)).unwrap_or(self.rest.len());
        let (prefix, remainder) = self.rest.split_at(end);
        self.rest = remainder;
        prefix
    }

    fn sum(&mut self) -> Option<f64> {
        let mut value = self.product()?;
        loop {
            if self.accept('+') {
                value += self.product()?;
            } else if self.accept('-') {
                value -= self.product()?;
            } else {
                return Some(value);
            }
        }
    }

    fn product(&mut self) -> Option<f64> {
        let mut value = self.signed()?;
        loop {
            if self.accept('*') {
                value *= self.signed()?;
            } else if self.accept('/') {
                value /= self.signed()?;
            } else if self.accept('%') {
                value %= self.signed()?;
            // A factor without an operator: implicit multiplication.
            } else if self.peek().is_some_and(|c| c == '(' || c == '_' || c.is_alphanumeric()) {
                value *= self.power()?;
            } else {
                return Some(value);
            }
        }
    }

    fn signed(&mut self) -> Option<f64> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return None;
        }
        let value = if self.accept('-') {
            self.signed().map(|value| -value)
        } else if self.accept('+') {
            self.signed()
        } else {
            self.power()
        };
        self.depth -= 1;
        value
    }

    fn power(&mut self) -> Option<f64> {
        let base = self.operand()?;
        // `^` is right-associative, and its exponent may have a sign.
        if self.accept('^') { Some(base.powf(self.signed()?)) } else { Some(base) }
    }

    fn operand(&mut self) -> Option<f64> {
        if self.accept('(') {
            self.depth += 1;
            let value = if self.depth > MAX_DEPTH { None } else { self.sum() };
            self.depth -= 1;
            return value.filter(|_| self.accept(')'));
        }
        if self.peek()?.is_ascii_digit() || self.rest.starts_with('.') {
            return self.number();
        }
        let name = self.take(|c| c == '_' || c.is_alphanumeric());
        if name.is_empty() {
            return None;
        }
        if let Some((_, value)) = self.variables.iter().find(|(known, _)| *known == name) {
            return Some(*value);
        }
        match name {
            "pi" => Some(std::f64::consts::PI),
            "e" => Some(std::f64::consts::E),
            _ => self.call(name),
        }
    }

    /// Parses `1`, `2.5`, `.5` or `1.5e-3`. An `e` without digits starts a name instead.
    fn number(&mut self) -> Option<f64> {
        let before = self.rest;
        let digits = |parser: &mut Self| parser.take(|c| c.is_ascii_digit()).len();
        let whole = digits(self);
        let mut length = whole;
        if let Some(rest) = self.rest.strip_prefix('.') {
            self.rest = rest;
            length += 1 + digits(self);
        }
        let mantissa = length;
        if let Some(rest) = self.rest.strip_prefix(['e', 'E']) {
            let signed = rest.strip_prefix(['+', '-']).unwrap_or(rest);
            let after = self.rest;
            self.rest = signed;
            let exponent = digits(self);
            length = mantissa + (after.len() - signed.len()) + exponent;
            if exponent == 0 {
                (self.rest, length) = (after, mantissa);
            }
        }
        before[..length].parse().ok()
    }

    fn call(&mut self, name: &str) -> Option<f64> {
        if !self.accept('(') {
            return None;
        }
        self.depth += 1;
        let mut arguments = Vec::new();
        loop {
            if self.depth > MAX_DEPTH {
                return None;
            }
            arguments.push(self.sum()?);
            if !self.accept(',') {
                break;
            }
        }
        self.depth -= 1;
        if !self.accept(')') {
            return None;
        }
        Some(match (name, arguments.as_slice()) {
            ("sqrt", [x]) => x.sqrt(),
            ("exp", [x]) => x.exp(),
            ("ln", [x]) => x.ln(),
            ("log", [x]) => x.log10(),
            ("abs", [x]) => x.abs(),
            ("sin", [x]) => x.sin(),
            ("cos", [x]) => x.cos(),
            ("tan", [x]) => x.tan(),
            ("asin", [x]) => x.asin(),
            ("acos", [x]) => x.acos(),
            ("atan", [x]) => x.atan(),
            ("sinh", [x]) => x.sinh(),
            ("cosh", [x]) => x.cosh(),
            ("tanh", [x]) => x.tanh(),
            ("asinh", [x]) => x.asinh(),
            ("acosh", [x]) => x.acosh(),
            ("atanh", [x]) => x.atanh(),
            ("atan2", [y, x]) => y.atan2(*x),
            ("mod", [x, y]) => x % y,
            ("sum", terms) => terms.iter().sum(),
            _ => return None,
        })
    }
}
