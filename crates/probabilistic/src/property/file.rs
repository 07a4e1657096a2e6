//! Parses property files: properties, and declarations that the properties use.

use crate::error::{Error, Place};
use crate::prism::ast::{Constant, Named, Property};
use crate::prism::expression::{Cursor, Read};
use crate::prism::lexer::{Kind, tokens};
use crate::prism::{constant_declaration, named_expression};
use crate::property::grammar::{PROPERTY_SYNTAX, property};

/// The contents of a property file.
#[derive(Debug, Clone, Default)]
pub struct File {
    /// The declared constants, labels and named properties.
    pub declarations: Declarations,
    /// The properties to check, in the order of the file.
    pub properties: Vec<Listed>,
}

/// The declarations of a property file. Its properties can use them in addition to the declarations
/// of the model.
#[derive(Debug, Clone, Default)]
pub struct Declarations {
    /// The constants; the user must set the values of undefined constants.
    pub constants: Vec<Constant>,
    /// The labels.
    pub labels: Vec<Named>,
    /// The named properties, which other properties can refer to by name, as in `1 - "hit"`. A
    /// label with the same name takes precedence.
    pub properties: Vec<(String, Property)>,
}

/// A property in a property file.
#[derive(Debug, Clone)]
pub struct Listed {
    /// The name of the property, or `None` for an unnamed property.
    pub name: Option<String>,
    /// The parsed property.
    pub property: Property,
    /// The source text of the property after its name, up to the first comment in or after the property.
    pub text: String,
    /// Position of the property in the file, after its name.
    pub place: Place,
}

/// Parses a property file, which contains properties, constants and labels.
///
/// # Errors
/// All syntax errors; after an error, parsing continues after the next `;`. If the text contains
/// invalid characters or unclosed quotation marks, only these are reported. A property of an
/// unsupported kind is not an error: it becomes [`Property::Refused`], which is reported when the
/// property is checked.
pub fn parse_file(text: &str) -> Result<File, Error> {
    let tokens = tokens(text).map_err(|problems| Error::Property(problems.into()))?;
    let mut cursor = Cursor::for_properties(&tokens, PROPERTY_SYNTAX);
    let (mut file, mut problems) = (File::default(), Vec::new());
    let ends = text.match_indices('\n').map(|(at, _)| at.saturating_add(1));
    let lines: Vec<usize> = std::iter::once(0).chain(ends).collect();
    while *cursor.peek() != Kind::End {
        if cursor.take(";") {
            continue;
        }
        if let Err(problem) = entry(&mut cursor, (text, &lines), &mut file) {
            problems.push(problem);
            cursor.reset();
            while !cursor.is(";") && *cursor.peek() != Kind::End {
                cursor.advance();
            }
        }
    }
    if problems.is_empty() { Ok(file) } else { Err(Error::Property(problems.into())) }
}

fn entry(cursor: &mut Cursor<'_>, (text, lines): (&str, &[usize]), file: &mut File) -> Read<()> {
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
    let begin = position(text, lines, place);
    let start = cursor.position();
    let property = match property(cursor) {
        // An unsupported property is skipped, so that the other properties can still be checked.
        Err(problem) if problem.code == "Q403" => {
            cursor.back_to(start);
            skip_property(cursor);
            Property::Refused(problem)
        }
        read => read?,
    };
    let end = if *cursor.peek() == Kind::End { text.len() } else { position(text, lines, cursor.place()) };
    // A comment after the property is not part of its source text.
    let source = text[begin..end].split("//").next().unwrap_or("").trim().to_owned();
    if let Some(name) = &name {
        file.declarations.properties.push((name.clone(), property.clone()));
    }
    file.properties.push(Listed { name, property, text: source, place });
    Ok(())
}

/// Skips an unsupported property: up to `;`, or past a closing bracket after which a new property begins.
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

/// Returns the byte offset of a place in a text. `lines` are the offsets of its lines.
fn position(text: &str, lines: &[usize], place: Place) -> usize {
    let before = lines.get(place.line.saturating_sub(1)).copied().unwrap_or(text.len());
    let line = &text[before..];
    let within = line.char_indices().nth(place.column.saturating_sub(1)).map_or(line.len(), |(at, _)| at);
    before.saturating_add(within)
}
