//! Access token for the web page. Its digest is compared in constant time, and the token is never printed.

use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest as _, Sha256};
use subtle::ConstantTimeEq as _;

use crate::message::Message;

/// Minimum length of a token in characters; shorter tokens can be guessed.
const MIN_LENGTH: usize = 16;

/// Maximum length of a token in characters; a longer text is probably not a token.
const MAX_LENGTH: usize = 1024;

/// An access token, of which only the SHA-256 digest is stored.
#[derive(Clone)]
pub struct Token([u8; 32]);

impl std::fmt::Debug for Token {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("Token(…)")
    }
}

impl Token {
    /// Reads a token from a file: one word of 16 to 1,024 visible ASCII characters.
    ///
    /// # Errors
    /// The file cannot be read or does not contain a token. The message never quotes its contents.
    pub fn read(path: &Path) -> Result<Self, Message> {
        let name = path.display().to_string();
        let wrong = |text: String| Message::at("M332", &name, None, text);
        let size = std::fs::metadata(path).map_or(0, |data| data.len());
        if size > 2 * MAX_LENGTH as u64 {
            return Err(wrong("this is too long for a token".to_owned()));
        }
        let text = std::fs::read(path).map_err(|error| wrong(format!("the file cannot be read: {error}")))?;
        let word = text.trim_ascii();
        let fits = (MIN_LENGTH..=MAX_LENGTH).contains(&word.len()) && word.iter().all(u8::is_ascii_graphic);
        if !fits {
            let text =
                format!("a token is one word of {MIN_LENGTH} to {MAX_LENGTH} visible characters of ASCII");
            return Err(wrong(text));
        }
        Ok(Self::of(word))
    }

    fn of(word: &[u8]) -> Self {
        Self(Sha256::digest(word).into())
    }

    /// Returns `true` if an `Authorization` header contains the token. The time of the comparison
    /// does not depend on the token.
    pub(super) fn fits(&self, authorization: &[u8]) -> bool {
        let (scheme, rest) = match authorization.iter().position(|byte| *byte == b' ') {
            None => return false,
            Some(space) => (&authorization[..space], authorization[space..].trim_ascii()),
        };
        let candidate = if scheme.eq_ignore_ascii_case(b"bearer") {
            rest.to_vec()
        } else if scheme.eq_ignore_ascii_case(b"basic") {
            let Ok(pair) = STANDARD.decode(rest) else { return false };
            let Some(colon) = pair.iter().position(|byte| *byte == b':') else { return false };
            pair[colon + 1..].to_vec()
        } else {
            return false;
        };
        Self::of(&candidate).0.ct_eq(&self.0).into()
    }
}

#[cfg(test)]
mod tests {
    use super::Token;

    #[test]
    fn tokens_match_as_password_and_as_bearer() {
        let token = Token::of(b"open sesame, now");
        let check = |header: &str, fits: bool| assert_eq!(token.fits(header.as_bytes()), fits, "{header}");
        check("Bearer open sesame, now", true);
        check("bearer  open sesame, now ", true);
        // Base64 of `robot:open sesame, now`, by RFC 4648.
        check("Basic cm9ib3Q6b3BlbiBzZXNhbWUsIG5vdw==", true);
        check("Basic b3BlbiBzZXNhbWUsIG5vdw==", false);
        check("Bearer open sesame, no", false);
        check("Bearer open sesame, now!", false);
        check("Digest open sesame, now", false);
        check("open sesame, now", false);
        check("", false);
        assert_eq!(format!("{token:?}"), "Token(…)");
    }
}
