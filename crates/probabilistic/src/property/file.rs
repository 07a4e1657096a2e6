//! Parses files of properties with their declarations.

use crate::error::{Error, Place};
use crate::prism::ast::{Constant, Named, Property};
use crate::prism::expression::{Cursor, Read};
use crate::prism::lexer::{Kind, tokens};
use crate::prism::{constant_declaration, named_expression};
use crate::property::grammar::{PROPERTY_SYNTAX, property};

/// A file of properties: its declarations, and its properties in order.
#[derive(Debug, Clone, Default)]
pub struct File {
    /// Constants, labels and named properties.
    pub declarations: Declarations,
    /// The properties.
    pub properties: Vec<Listed>,
}

/// Declarations of a property file, which its properties can use in addition to those of the model.
#[derive(Debug, Clone, Default)]
pub struct Declarations {
    /// Constants, possibly undefined.
    pub constants: Vec<Constant>,
    /// Labels.
    pub labels: Vec<Named>,
    /// Named properties, which other properties can use: `1 - "hit"`. A label with the same name takes precedence.
    pub properties: Vec<(String, Property)>,
}

/// A property of a file.
#[derive(Debug, Clone)]
pub struct Listed {
    /// The name, if it has one.
    pub name: Option<String>,
    /// The property.
    pub property: Property,
    /// The text, without the name.
    pub text: String,
    /// Position of the property.
    pub place: Place,
}

/// Parses a file of properties, constants and labels.
///
/// # Errors
/// All syntax errors; after an error, parsing continues after the next `;`. A property of an unsupported kind is not an
/// error: it becomes [`Property::Refused`], which is reported when the property is checked.
pub fn parse_file(text: &str) -> Result<File, Error> {
    let tokens = tokens(text).map_err(|problems| Error::Property(problems.into()))?;
    let mut cursor = Cursor::for_properties(&tokens, PROPERTY_SYNTAX);
    let (mut file, mut problems) = (File::default(), Vec::new());
    while *cursor.peek() != Kind::End {
        if cursor.take(";") {
            continue;
        }
        if let Err(problem) = entry(&mut cursor, text, &mut file) {
            problems.push(problem);
            cursor.reset();
            while !cursor.is(";") && *cursor.peek() != Kind::End {
                cursor.advance();
            }
        }
    }
    if problems.is_empty() { Ok(file) } else { Err(Error::Property(problems.into())) }
}

fn entry(cursor: &mut Cursor<'_>, text: &str, file: &mut File) -> Read<()> {
    if cursor.is_word("const") {
        file.declarations.constants.push(constant_declaration(cursor)?);
        return Ok(());
    }
    if cursor.is_word("label") {
        file.declarations.labels.push(named_expression(cursor)?);
        return Ok(());
    }
    let mut name = None;
    if let (Kind::Quoted(quoted), Kind::Sign(":")) = (cursor.peek(), cursor.peek_at(1)) {
        name = Some(quoted.clone());
        cursor.advance();
        cursor.advance();
    }
    let place = cursor.place();
    let begin = position(text, place);
    let start = cursor.position();
    let property = match property(cursor) {
        // An unsupported property is skipped, so that the others can be checked.
        Err(problem) if problem.code == "Q403" => {
            cursor.back_to(start);
            skip_property(cursor);
            Property::Refused(problem)
        }
        read => read?,
    };
    let end = if *cursor.peek() == Kind::End { text.len() } else { position(text, cursor.place()) };
    // A comment between this property and the next one is not part of it.
    let source = text[begin..end].split("//").next().unwrap_or("").trim().to_owned();
    if let Some(name) = &name {
        file.declarations.properties.push((name.clone(), property.clone()));
    }
    file.properties.push(Listed { name, property, text: source, place });
    Ok(())
}

/// Skips an unsupported property: to `;`, or to a closing bracket after which a new property begins.
fn skip_property(cursor: &mut Cursor<'_>) {
    let mut open = 0_usize;
    loop {
        match cursor.peek() {
            Kind::End => return,
            Kind::Sign(";") if open == 0 => return,
            Kind::Sign("(" | "[" | "{") => open = open.saturating_add(1),
            Kind::Sign(")" | "]" | "}") => open = open.saturating_sub(1),
            _ => {}
        }
        let closes = cursor.is("]") || cursor.is(")");
        cursor.advance();
        if closes && open == 0 && matches!(cursor.peek(), Kind::Name(_) | Kind::Quoted(_)) {
            return;
        }
    }
}

/// Converts a position to a byte offset.
fn position(text: &str, place: Place) -> usize {
    let lines = text.split_inclusive('\n').take(place.line.saturating_sub(1));
    let before = lines.map(str::len).fold(0, usize::saturating_add);
    let line = &text[before..];
    let within = line.char_indices().nth(place.column.saturating_sub(1)).map_or(line.len(), |(at, _)| at);
    before.saturating_add(within)
}
