//! Tokens to expressions, by precedence climbing.

use crate::error::{Diagnostic, Place};
use crate::number::parse_decimal;
use crate::prism::ast::{BinaryOp, Expr, ExprKind, Function};
use crate::prism::lexer::{Kind, Token};
use crate::prism::reserved::is_keyword;

/// How deep expressions may be nested.
const DEPTH: usize = 200;
/// How many operators of arithmetic (and of implication) an expression may have, and how many others.
const OPERATORS: [usize; 2] = [500, 20_000];
/// How many of either kind an expression of a property may have.
const PROPERTY: usize = 2_000;

/// Tokens and how far they are read.
#[derive(Debug)]
pub struct Cursor<'a> {
    tokens: &'a [Token],
    at: usize,
    depth: usize,
    /// The operators of the expression at hand, as [`OPERATORS`] counts them.
    operators: [usize; 2],
    /// What expressions of properties have besides.
    besides: Option<Besides>,
}

/// What expressions of properties have besides those of models.
#[derive(Debug, Clone, Copy)]
pub struct Besides {
    /// What starts with a word, if the next one is such a word.
    pub start: fn(&mut Cursor<'_>) -> Read<Option<ExprKind>>,
    /// What continues an expression.
    pub go_on: fn(&mut Cursor<'_>, Expr) -> Read<Expr>,
}

/// What reading returns.
pub type Read<T> = Result<T, Diagnostic>;

impl<'a> Cursor<'a> {
    /// At the first token; the last one must be the end.
    pub fn new(tokens: &'a [Token]) -> Self {
        Self { tokens, at: 0, depth: 0, operators: [0; 2], besides: None }
    }

    /// The same for the expressions of properties.
    pub fn of_properties(tokens: &'a [Token], besides: Besides) -> Self {
        Self { besides: Some(besides), ..Self::new(tokens) }
    }

    /// How many tokens are read.
    pub fn position(&self) -> usize {
        self.at
    }

    /// After a mistake: nothing is open any more.
    pub fn reset(&mut self) {
        self.depth = 0;
    }

    /// Goes on after so many tokens, with nothing open.
    pub fn back_to(&mut self, position: usize) {
        self.at = position.min(self.tokens.len().saturating_sub(1));
        self.depth = 0;
    }

    /// The next token.
    pub fn peek(&self) -> &'a Kind {
        &self.tokens[self.at].kind
    }

    /// The token after so many others.
    pub fn peek_at(&self, offset: usize) -> &'a Kind {
        self.tokens.get(self.at.saturating_add(offset)).map_or(&Kind::End, |token| &token.kind)
    }

    /// Where the next token is.
    pub fn place(&self) -> Place {
        self.tokens[self.at].place
    }

    /// Takes a token.
    pub fn advance(&mut self) {
        let next = self.at.saturating_add(1);
        if next < self.tokens.len() {
            self.at = next;
        }
    }

    /// Whether the next token is this sign.
    pub fn is(&self, sign: &str) -> bool {
        matches!(self.peek(), Kind::Sign(found) if *found == sign)
    }

    /// Whether the next token is this word.
    pub fn is_word(&self, word: &str) -> bool {
        matches!(self.peek(), Kind::Name(found) if found == word)
    }

    /// Takes a sign if it is next.
    pub fn take(&mut self, sign: &str) -> bool {
        let found = self.is(sign);
        if found {
            self.advance();
        }
        found
    }

    /// Takes a word if it is next.
    pub fn take_word(&mut self, word: &str) -> bool {
        let found = self.is_word(word);
        if found {
            self.advance();
        }
        found
    }

    /// That something else was expected here.
    pub fn expected(&self, what: &str) -> Diagnostic {
        Diagnostic::new(
            "Q102",
            self.place(),
            format!("{what} is expected here, not {}", self.peek().describe()),
        )
    }

    /// Takes a sign that must be next.
    pub fn need(&mut self, sign: &str) -> Read<()> {
        if self.take(sign) { Ok(()) } else { Err(self.expected(&format!("`{sign}`"))) }
    }

    /// Takes a word that must be next.
    pub fn need_word(&mut self, word: &str) -> Read<()> {
        if self.take_word(word) { Ok(()) } else { Err(self.expected(&format!("`{word}`"))) }
    }

    /// Takes a name that must be next.
    pub fn name(&mut self, what: &str) -> Read<(String, Place)> {
        let place = self.place();
        match self.peek() {
            Kind::Name(name) if !is_keyword(name) => {
                self.advance();
                Ok((name.clone(), place))
            }
            Kind::Name(name) => Err(Diagnostic::new(
                "Q103",
                place,
                format!("`{name}` is a word of the PRISM language and cannot be {what}"),
            )),
            _ => Err(self.expected(what)),
        }
    }

    /// An expression.
    ///
    /// # Errors
    /// The first thing that is none.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "refused as soon as it passes its limit, and each leaves the depth that it entered"
    )]
    pub fn expression(&mut self) -> Read<Expr> {
        if self.depth == 0 {
            self.operators = [0; 2];
        }
        self.depth += 1;
        if self.depth > DEPTH {
            return Err(Diagnostic::new("Q104", self.place(), "this expression is nested too deeply"));
        }
        let condition = self.binary(2)?;
        let result = if self.take("?") {
            let then = self.expression()?;
            self.need(":")?;
            let otherwise = self.expression()?;
            let place = condition.place;
            let kind = ExprKind::If(Box::new(condition), Box::new(then), Box::new(otherwise));
            Expr { kind, place }
        } else {
            condition
        };
        self.depth -= 1;
        Ok(result)
    }

    fn operator(&self) -> Option<(BinaryOp, u8)> {
        let Kind::Sign(sign) = self.peek() else { return None };
        // `=?` ends an operator of a property; a condition in an expression has its `?` after an operand.
        if *sign == "=" && matches!(self.peek_at(1), Kind::Sign("?")) {
            return None;
        }
        let found = BinaryOp::ALL.into_iter().find(|op| op.sign().0 == *sign)?;
        Some((found, found.sign().1))
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "refused as soon as it passes its limit; strengths are below 20"
    )]
    fn binary(&mut self, least: u8) -> Read<Expr> {
        let mut left = self.unary(least)?;
        while let Some((op, strength)) = self.operator().filter(|(_, strength)| *strength >= least) {
            let kind = usize::from(!op.is_arithmetic() && op != BinaryOp::Implies);
            self.operators[kind] += 1;
            let most = if self.besides.is_some() { OPERATORS[kind].min(PROPERTY) } else { OPERATORS[kind] };
            if self.operators[kind] > most {
                return Err(Diagnostic::new("Q104", self.place(), "this expression is too long"));
            }
            self.advance();
            // `=>` is right-associative, everything else left-associative.
            let right = self.binary(if op == BinaryOp::Implies { strength } else { strength + 1 })?;
            let place = left.place;
            left = Expr { kind: ExprKind::Binary(op, Box::new(left), Box::new(right)), place };
        }
        Ok(left)
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "refused as soon as it passes its limit, and each leaves the depth that it entered"
    )]
    fn unary(&mut self, least: u8) -> Read<Expr> {
        let place = self.place();
        self.depth += 1;
        if self.depth > DEPTH {
            return Err(Diagnostic::new("Q104", place, "this expression is nested too deeply"));
        }
        let result = if self.take("!") {
            // Binds less than comparisons: `!x=1` is `!(x=1)`.
            let inner = self.binary(least.clamp(6, 7))?;
            Expr { kind: ExprKind::Not(Box::new(inner)), place }
        } else if self.take("-") {
            let inner = self.unary(11)?;
            Expr { kind: ExprKind::Negative(Box::new(inner)), place }
        } else {
            self.primary()?
        };
        self.depth -= 1;
        Ok(result)
    }

    fn primary(&mut self) -> Read<Expr> {
        let place = self.place();
        if let Some(besides) = self.besides
            && let Some(kind) = (besides.start)(self)?
        {
            return Ok(Expr { kind, place });
        }
        let kind = match self.peek() {
            Kind::Number(text) => {
                self.advance();
                number(text).map_err(|message| Diagnostic::new("Q105", place, message))?
            }
            Kind::Quoted(label) => {
                self.advance();
                ExprKind::Label(label.clone())
            }
            Kind::Sign("(") => {
                self.advance();
                let mut inner = self.expression()?;
                if let Some(besides) = self.besides {
                    inner = (besides.go_on)(self, inner)?;
                }
                self.need(")")?;
                return Ok(Expr { place, ..inner });
            }
            Kind::Name(word) => match word.as_str() {
                "true" | "false" => {
                    self.advance();
                    ExprKind::Bool(word == "true")
                }
                "func" => return self.function_by_word(),
                _ => match Function::ALL.iter().find(|(name, _)| name == word) {
                    Some((_, function)) if matches!(self.peek_at(1), Kind::Sign("(")) => {
                        self.advance();
                        self.need("(")?;
                        self.arguments(*function)?
                    }
                    _ => ExprKind::Name(self.name("an expression")?.0),
                },
            },
            _ => return Err(self.expected("an expression")),
        };
        Ok(Expr { kind, place })
    }

    /// The old form `func(min, a, b)`.
    fn function_by_word(&mut self) -> Read<Expr> {
        let place = self.place();
        self.advance();
        self.need("(")?;
        let known = Function::ALL.iter().find(|(name, _)| self.is_word(name));
        let Some((_, function)) = known else { return Err(self.expected("the name of a function")) };
        self.advance();
        self.need(",")?;
        Ok(Expr { kind: self.arguments(*function)?, place })
    }

    fn arguments(&mut self, function: Function) -> Read<ExprKind> {
        let place = self.place();
        let mut arguments = vec![self.expression()?];
        while self.take(",") {
            arguments.push(self.expression()?);
        }
        self.need(")")?;
        let fits = match function {
            Function::Min | Function::Max => arguments.len() >= 2,
            Function::Floor | Function::Ceil | Function::Round => arguments.len() == 1,
            Function::Pow | Function::Mod | Function::Log => arguments.len() == 2,
        };
        if fits {
            return Ok(ExprKind::Call(function, arguments));
        }
        let text = format!("`{}` does not take {} arguments", function.name(), arguments.len());
        Err(Diagnostic::new("Q106", place, text))
    }
}

fn number(text: &str) -> Result<ExprKind, String> {
    if text.bytes().all(|byte| byte.is_ascii_digit()) {
        return text.parse().map(ExprKind::Int).map_err(|_| format!("{text} is too large for an integer"));
    }
    parse_decimal(text).map(ExprKind::Number).ok_or_else(|| format!("`{text}` is out of range"))
}
