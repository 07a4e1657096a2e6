//! Parses expressions by precedence climbing.

use crate::error::{Diagnostic, Place};
use crate::number::parse_decimal;
use crate::prism::ast::{BinaryOp, Expr, ExprKind, Function};
use crate::prism::lexer::{Kind, Token};
use crate::prism::reserved::is_keyword;

const MAX_DEPTH: usize = 200;
/// Upper limits on the number of binary operators in a top-level expression: of arithmetic operators and
/// implications, and of all others.
const MAX_OPERATORS: [usize; 2] = [500, 20_000];
/// Additional upper limit on each of the two numbers in [`MAX_OPERATORS`], in an expression of a property.
const MAX_PROPERTY_OPERATORS: usize = 2_000;

#[derive(Debug)]
pub struct Cursor<'a> {
    tokens: &'a [Token],
    at: usize,
    depth: usize,
    /// Number of operators in the current top-level expression, by kind as in [`MAX_OPERATORS`].
    operators: [usize; 2],
    /// Parsers of the additional syntax of properties; `None` in models.
    property_syntax: Option<PropertySyntax>,
}

#[derive(Debug, Clone, Copy)]
pub struct PropertySyntax {
    /// Parses an expression that begins with a property operator. Returns `None` if the next token is not such an
    /// operator.
    pub parse_prefix: fn(&mut Cursor<'_>) -> Read<Option<ExprKind>>,
    /// Parses an infix operator of properties, given its left operand. Returns the operand unchanged if no such
    /// operator follows.
    pub parse_infix: fn(&mut Cursor<'_>, Expr) -> Read<Expr>,
}

pub type Read<T> = Result<T, Diagnostic>;

impl<'a> Cursor<'a> {
    /// Creates a cursor at the first token; the last token must be [`Kind::End`].
    pub fn new(tokens: &'a [Token]) -> Self {
        Self { tokens, at: 0, depth: 0, operators: [0; 2], property_syntax: None }
    }

    pub fn for_properties(tokens: &'a [Token], property_syntax: PropertySyntax) -> Self {
        Self { property_syntax: Some(property_syntax), ..Self::new(tokens) }
    }

    pub fn position(&self) -> usize {
        self.at
    }

    pub fn reset(&mut self) {
        self.depth = 0;
    }

    /// Moves to a position that [`Self::position`] returned, and resets the nesting depth.
    pub fn back_to(&mut self, position: usize) {
        self.at = position.min(self.tokens.len().saturating_sub(1));
        self.depth = 0;
    }

    pub fn peek(&self) -> &'a Kind {
        &self.tokens[self.at].kind
    }

    /// Returns the token `offset` positions after the next one, or [`Kind::End`] beyond the last token.
    pub fn peek_at(&self, offset: usize) -> &'a Kind {
        self.tokens.get(self.at.saturating_add(offset)).map_or(&Kind::End, |token| &token.kind)
    }

    pub fn place(&self) -> Place {
        self.tokens[self.at].place
    }

    /// Consumes the next token, unless it is the last one.
    pub fn advance(&mut self) {
        let next = self.at.saturating_add(1);
        if next < self.tokens.len() {
            self.at = next;
        }
    }

    pub fn is(&self, sign: &str) -> bool {
        matches!(self.peek(), Kind::Sign(found) if *found == sign)
    }

    pub fn is_word(&self, word: &str) -> bool {
        matches!(self.peek(), Kind::Name(found) if found == word)
    }

    /// Consumes the next token if it is the symbol `sign`. Returns `true` if it was consumed.
    pub fn take(&mut self, sign: &str) -> bool {
        let is_next = self.is(sign);
        if is_next {
            self.advance();
        }
        is_next
    }

    pub fn take_word(&mut self, word: &str) -> bool {
        let is_next = self.is_word(word);
        if is_next {
            self.advance();
        }
        is_next
    }

    /// Creates a syntax error at the next token: the described element is expected there.
    pub fn expected(&self, description: &str) -> Diagnostic {
        Diagnostic::new(
            "Q102",
            self.place(),
            format!("{description} is expected here, not {}", self.peek().describe()),
        )
    }

    pub fn need(&mut self, sign: &str) -> Read<()> {
        if self.take(sign) { Ok(()) } else { Err(self.expected(&format!("`{sign}`"))) }
    }

    pub fn need_word(&mut self, word: &str) -> Read<()> {
        if self.take_word(word) { Ok(()) } else { Err(self.expected(&format!("`{word}`"))) }
    }

    /// Consumes an identifier that is not a keyword, and returns it with its position. Otherwise returns an error;
    /// `description` names the expected element.
    pub fn name(&mut self, description: &str) -> Read<(String, Place)> {
        let place = self.place();
        match self.peek() {
            Kind::Name(name) if !is_keyword(name) => {
                self.advance();
                Ok((name.clone(), place))
            }
            Kind::Name(name) => Err(Diagnostic::new(
                "Q103",
                place,
                format!("`{name}` is a word of the PRISM language and cannot be {description}"),
            )),
            _ => Err(self.expected(description)),
        }
    }

    /// Parses an expression.
    ///
    /// # Errors
    /// The first syntax error, or an expression beyond the limits on nesting and operators.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "refused as soon as it passes its limit, and each leaves the depth that it entered"
    )]
    pub fn expression(&mut self) -> Read<Expr> {
        if self.depth == 0 {
            self.operators = [0; 2];
        }
        self.depth += 1;
        if self.depth > MAX_DEPTH {
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
        // `=?` ends a property operator. The `?` of a conditional expression follows an operand, never `=`.
        if *sign == "=" && matches!(self.peek_at(1), Kind::Sign("?")) {
            return None;
        }
        let op = BinaryOp::ALL.into_iter().find(|op| op.sign().0 == *sign)?;
        Some((op, op.sign().1))
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
            let limit = if self.property_syntax.is_some() {
                MAX_OPERATORS[kind].min(MAX_PROPERTY_OPERATORS)
            } else {
                MAX_OPERATORS[kind]
            };
            if self.operators[kind] > limit {
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
        if self.depth > MAX_DEPTH {
            return Err(Diagnostic::new("Q104", place, "this expression is nested too deeply"));
        }
        let result = if self.take("!") {
            // `!` binds less than comparisons: `!x=1` is `!(x=1)`.
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
        if let Some(property_syntax) = self.property_syntax
            && let Some(kind) = (property_syntax.parse_prefix)(self)?
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
                if let Some(property_syntax) = self.property_syntax {
                    inner = (property_syntax.parse_infix)(self, inner)?;
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

    /// Parses a function call in the old syntax `func(min, a, b)`.
    fn function_by_word(&mut self) -> Read<Expr> {
        let place = self.place();
        self.advance();
        self.need("(")?;
        let entry = Function::ALL.iter().find(|(name, _)| self.is_word(name));
        let Some((_, function)) = entry else { return Err(self.expected("the name of a function")) };
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
