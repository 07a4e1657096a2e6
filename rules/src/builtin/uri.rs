//! URI functions of SWRL ([1], section 8.6), by the generic syntax of RFC 3986.
//!
//! [1] W3C Member Submission: SWRL, 2004.

use oxiri::{Iri, IriRef};

use super::signature::BuiltIn;
use super::text::as_text;
use crate::literal::Literal;

pub(super) fn compute(built_in: BuiltIn, arguments: &[&Literal]) -> Option<Literal> {
    let text = match (built_in, arguments) {
        (BuiltIn::ResolveUri, [reference, base]) => {
            Iri::parse(as_text(base)?).ok()?.resolve(as_text(reference)?).ok()?.into_inner()
        }
        (BuiltIn::AnyUri, parts) => {
            let parts: Vec<String> = parts.iter().map(|part| part.lexical()).collect();
            compose(&parts)?
        }
        _ => return None,
    };
    Some(Literal::Uri(text.into()))
}

/// Composes a URI reference from its parts. Returns `None` if the composed text has other parts when it
/// is parsed.
fn compose(components: &[String]) -> Option<String> {
    let [scheme, host, port, path, query, fragment] = components else { return None };
    let mark = |before: &str, part: &str, after: &str| {
        if part.is_empty() { String::new() } else { format!("{before}{part}{after}") }
    };
    let authority = mark("//", &format!("{host}{}", mark(":", port, "")), "");
    let (scheme, query, fragment) = (mark("", scheme, ":"), mark("?", query, ""), mark("#", fragment, ""));
    let text = format!("{scheme}{authority}{path}{query}{fragment}");
    let parsed = parts(&text)?;
    parsed.iter().zip(components).all(|(parsed, component)| parsed.lexical() == *component).then_some(text)
}

/// Splits a URI reference into scheme, host, port, path, query and fragment. Returns `None` for an
/// invalid reference, and for a reference with a user name, because there is no part for it.
pub(super) fn parts(text: &str) -> Option<Vec<Literal>> {
    let iri = IriRef::parse(text).ok()?;
    let authority = iri.authority().unwrap_or_default();
    let (host, port) = match authority.rsplit_once(':') {
        Some((host, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => (host, port),
        _ => (authority, ""),
    };
    let string = |text: Option<&str>| Literal::string(text.unwrap_or_default());
    let port = match port.parse() {
        Ok(number) => Literal::integer(number),
        Err(_) => Literal::string(""),
    };
    let path = Literal::string(iri.path());
    let parts = [
        string(iri.scheme()),
        Literal::string(host),
        port,
        path,
        string(iri.query()),
        string(iri.fragment()),
    ];
    (!authority.contains('@')).then(|| parts.to_vec())
}
