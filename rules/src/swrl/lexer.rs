//! Lexer: splits rule text into tokens with positions.

#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum Token {
    /// `@prefix`, or `prefix` or `PREFIX` before white space.
    Prefix,
    /// `<iri>`, without the brackets.
    Iri(String),
    /// `prefix:local`, `:local` or `local`. The prefix is `None` without a colon.
    Name(Option<String>, String),
    Variable(String),
    Text(String),
    Language(String),
    Number(String),
    Label(String),
    Carets,
    Open,
    Close,
    /// `{` and `}` enclose the content of an aggregate, and `|` separates its term from its atoms.
    OpenBrace,
    Bar,
    CloseBrace,
    Equals,
    /// `^` or `∧`. Unlike a comma, it cannot separate arguments.
    And,
    Comma,
    Arrow,
    Stop,
    End,
}

/// A token with its position, counted from 1. Columns are counted in characters.
#[derive(Clone, Debug)]
pub(super) struct Spanned {
    pub token: Token,
    pub line: u32,
    pub column: u32,
}

#[derive(Debug)]
pub(super) struct Fault {
    pub message: String,
    pub line: u32,
    pub column: u32,
}

struct Lexer {
    characters: Vec<char>,
    cursor: usize,
    line: u32,
    column: u32,
    /// Error within a token that was nevertheless read to its end.
    error: Option<String>,
}

/// Splits a text into tokens, terminated by [`Token::End`]. Unexpected characters and incomplete tokens are reported
/// and skipped.
pub(super) fn tokens(text: &str) -> (Vec<Spanned>, Vec<Fault>) {
    let mut lexer = Lexer { characters: text.chars().collect(), cursor: 0, line: 1, column: 1, error: None };
    let (mut tokens, mut faults) = (Vec::new(), Vec::new());
    loop {
        lexer.skip_blank();
        let (line, column) = (lexer.line, lexer.column);
        match lexer.next() {
            Ok(token) => {
                faults.extend(lexer.error.take().map(|message| Fault { message, line, column }));
                let end = token == Token::End;
                tokens.push(Spanned { token, line, column });
                if end {
                    return (tokens, faults);
                }
            }
            Err(message) => faults.push(Fault { message, line, column }),
        }
    }
}

fn is_name_start(character: char) -> bool {
    character.is_alphabetic() || character == '_'
}

fn is_name_part(character: char) -> bool {
    character.is_alphanumeric() || character == '_' || character == '-'
}

impl Lexer {
    fn peek(&self, ahead: usize) -> Option<char> {
        self.characters.get(self.cursor + ahead).copied()
    }

    fn bump(&mut self) -> Option<char> {
        let character = self.peek(0)?;
        self.cursor += 1;
        if character == '\n' {
            (self.line, self.column) = (self.line + 1, 1);
        } else {
            self.column += 1;
        }
        Some(character)
    }

    fn take_while(&mut self, keep: impl Fn(char) -> bool) -> String {
        let mut text = String::new();
        while let Some(character) = self.peek(0).filter(|&c| keep(c)) {
            text.push(character);
            self.bump();
        }
        text
    }

    fn skip_blank(&mut self) {
        loop {
            // `#` starts a comment that extends to the end of the line.
            self.take_while(char::is_whitespace);
            if self.peek(0) != Some('#') {
                return;
            }
            self.take_while(|c| c != '\n');
        }
    }

    fn next(&mut self) -> Result<Token, String> {
        let Some(first) = self.peek(0) else { return Ok(Token::End) };
        match first {
            '?' => self.variable(),
            '"' => self.text(),
            '<' => self.enclosed('>').map(Token::Iri),
            '[' => self.enclosed(']').map(|label| Token::Label(label.trim().to_string())),
            '@' => self.at_word(),
            '0'..='9' => Ok(self.number()),
            '+' | '-' | '.' if self.starts_number() => Ok(self.number()),
            '^' if self.peek(1) == Some('^') => Ok(self.symbol(2, Token::Carets)),
            '-' if self.peek(1) == Some('>') => Ok(self.symbol(2, Token::Arrow)),
            '→' => Ok(self.symbol(1, Token::Arrow)),
            '^' | '∧' => Ok(self.symbol(1, Token::And)),
            ',' => Ok(self.symbol(1, Token::Comma)),
            '(' => Ok(self.symbol(1, Token::Open)),
            ')' => Ok(self.symbol(1, Token::Close)),
            '{' => Ok(self.symbol(1, Token::OpenBrace)),
            '|' => Ok(self.symbol(1, Token::Bar)),
            '}' => Ok(self.symbol(1, Token::CloseBrace)),
            '=' => Ok(self.symbol(1, Token::Equals)),
            '.' => Ok(self.symbol(1, Token::Stop)),
            ':' => Ok(self.name()),
            other if is_name_start(other) => Ok(self.name()),
            other => {
                self.bump();
                Err(format!("unexpected character `{other}`"))
            }
        }
    }

    fn symbol(&mut self, length: usize, token: Token) -> Token {
        for _ in 0..length {
            self.bump();
        }
        token
    }

    fn starts_number(&self) -> bool {
        let digit = |ahead| self.peek(ahead).is_some_and(|c| c.is_ascii_digit());
        let dot = usize::from(self.peek(0) != Some('.'));
        digit(1) || (dot == 1 && self.peek(1) == Some('.') && digit(2))
    }

    /// Reads a sign, digits, a fraction and an exponent. A point without a following digit ends the rule
    /// instead.
    fn number(&mut self) -> Token {
        let mut text = String::new();
        if let Some(sign) = self.peek(0).filter(|c| "+-".contains(*c)) {
            text.push(sign);
            self.bump();
        }
        text += &self.take_while(|c| c.is_ascii_digit());
        if self.peek(0) == Some('.') && self.peek(1).is_some_and(|c| c.is_ascii_digit()) {
            self.bump();
            text.push('.');
            text += &self.take_while(|c| c.is_ascii_digit());
        }
        // `e` without digits belongs to the next token.
        let sign_length = usize::from(self.peek(1).is_some_and(|c| "+-".contains(c)));
        let exponent = self.peek(0).is_some_and(|c| "eE".contains(c));
        if exponent && self.peek(1 + sign_length).is_some_and(|c| c.is_ascii_digit()) {
            for _ in 0..=sign_length {
                text.extend(self.bump());
            }
            text += &self.take_while(|c| c.is_ascii_digit());
        }
        Token::Number(text)
    }

    fn variable(&mut self) -> Result<Token, String> {
        self.bump();
        let name = self.take_while(|c| is_name_part(c) || c == ':');
        if name.is_empty() {
            Err("a variable needs a name after `?`".into())
        } else {
            Ok(Token::Variable(name))
        }
    }

    /// Reads a name, which may contain full stops but not end with one.
    fn word(&mut self) -> String {
        let mut word = self.take_while(is_name_part);
        while self.peek(0) == Some('.') && self.peek(1).is_some_and(is_name_part) {
            self.bump();
            word.push('.');
            word += &self.take_while(is_name_part);
        }
        word
    }

    fn name(&mut self) -> Token {
        let word = self.word();
        if self.peek(0) == Some(':') {
            self.bump();
            let local = self.word();
            return Token::Name(Some(word), local);
        }
        match word.as_str() {
            "prefix" | "PREFIX" if self.peek(0).is_some_and(char::is_whitespace) => Token::Prefix,
            _ => Token::Name(None, word),
        }
    }

    fn at_word(&mut self) -> Result<Token, String> {
        self.bump();
        match self.take_while(is_name_part).as_str() {
            "" => Err("a language or `prefix` must follow `@`".into()),
            "prefix" => Ok(Token::Prefix),
            tag => Ok(Token::Language(tag.to_string())),
        }
    }

    fn enclosed(&mut self, close: char) -> Result<String, String> {
        self.bump();
        let inner = self.take_while(|c| c != close && c != '\n');
        match self.peek(0) {
            Some(c) if c == close => {
                self.bump();
                Ok(inner)
            }
            _ => Err(format!("`{close}` is missing")),
        }
    }

    fn text(&mut self) -> Result<Token, String> {
        self.bump();
        let mut text = String::new();
        while let Some(character) = self.bump() {
            match character {
                '"' => return Ok(Token::Text(text)),
                '\\' => text.push(match self.bump() {
                    Some('n') => '\n',
                    Some('r') => '\r',
                    Some('t') => '\t',
                    Some(c @ ('"' | '\\')) => c,
                    // The string is read to its end, so that its text is not taken for rules.
                    other => {
                        self.error = Some("unknown escape in a string".into());
                        other.unwrap_or_default()
                    }
                }),
                other => text.push(other),
            }
        }
        Err("the closing `\"` of a string is missing".into())
    }
}
