//! A file of properties to its properties, and what it declares.

use crate::error::{Error, Place};
use crate::prism::ast::{Constant, Named, Property};
use crate::prism::expression::{Cursor, Read};
use crate::prism::lexer::{Kind, tokens};
use crate::prism::{constant_declaration, named_expression};
use crate::property::grammar::{BESIDES, property};

/// A file of properties: what it declares besides, and the properties in their order.
#[derive(Debug, Clone, Default)]
pub struct File {
    /// Constants and labels, and which of the properties have names.
    pub declarations: Declarations,
    /// The properties.
    pub properties: Vec<Listed>,
}

/// What a file of properties declares, which its properties know besides what the model declares.
#[derive(Debug, Clone, Default)]
pub struct Declarations {
    /// Constants, which may be left open.
    pub constants: Vec<Constant>,
    /// Labels.
    pub labels: Vec<Named>,
    /// Properties with their names, which others may use as parts: `1 - "hit"`. A label that has the same name is meant before.
    pub properties: Vec<(String, Property)>,
}

/// A property of a file.
#[derive(Debug, Clone)]
pub struct Listed {
    /// Its name, if it has one.
    pub name: Option<String>,
    /// The property.
    pub property: Property,
    /// How it is written, without its name.
    pub text: String,
    /// Where it starts.
    pub place: Place,
}

/// Reads a file of properties, with its constants and labels.
///
/// # Errors
/// All that is wrong with it; after a wrong property, reading goes on behind the next `;`. What is read, but not handled, is a property
/// that is refused when it is checked.
pub fn parse_file(text: &str) -> Result<File, Error> {
    let tokens = tokens(text).map_err(|problems| Error::Property(problems.into()))?;
    let mut cursor = Cursor::of_properties(&tokens, BESIDES);
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
    if let (Kind::Quoted(found), Kind::Sign(":")) = (cursor.peek(), cursor.peek_at(1)) {
        name = Some(found.clone());
        cursor.advance();
        cursor.advance();
    }
    let place = cursor.place();
    let begin = position(text, place);
    let start = cursor.position();
    let property = match property(cursor) {
        Err(problem) if problem.code == "Q403" => {
            cursor.back_to(start);
            leave_out(cursor);
            Property::Refused(problem)
        }
        read => read?,
    };
    let end = if *cursor.peek() == Kind::End { text.len() } else { position(text, cursor.place()) };
    // A remark that stands between this property and the next is none of it.
    let written = text[begin..end].split("//").next().unwrap_or("").trim().to_owned();
    if let Some(name) = &name {
        file.declarations.properties.push((name.clone(), property.clone()));
    }
    file.properties.push(Listed { name, property, text: written, place });
    Ok(())
}

/// Goes to the end of a property that is not handled: `;`, or brackets that close and something that goes on with nothing.
fn leave_out(cursor: &mut Cursor<'_>) {
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

/// The position of a place in a text, in bytes.
fn position(text: &str, place: Place) -> usize {
    let lines = text.split_inclusive('\n').take(place.line.saturating_sub(1));
    let before = lines.map(str::len).fold(0, usize::saturating_add);
    let line = &text[before..];
    let within = line.char_indices().nth(place.column.saturating_sub(1)).map_or(line.len(), |(at, _)| at);
    before.saturating_add(within)
}
