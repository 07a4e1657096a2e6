//! Bytes of a connection to a request: its path and the headers that matter here.

use std::io::{self, Read};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// A head of more bytes is refused.
const LONGEST: usize = 16 << 10;

/// So many headers are read.
const HEADERS: usize = 64;

/// What is asked for.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Request {
    pub(super) path: String,
    pub(super) host: Option<String>,
    pub(super) authorization: Option<Vec<u8>>,
}

/// Why a request is not answered: a status and its words.
pub(super) type Refused = (u16, &'static str);

impl Request {
    /// Reads a request that has to be there within a time.
    pub(super) fn read(stream: &mut TcpStream, patience: Duration) -> io::Result<Result<Self, Refused>> {
        let begun = Instant::now();
        let mut bytes = Vec::new();
        let mut part = [0; 2048];
        loop {
            let left = patience.saturating_sub(begun.elapsed());
            if left.is_zero() {
                return Ok(Err((408, "Request Timeout")));
            }
            stream.set_read_timeout(Some(left))?;
            let count = stream.read(&mut part)?;
            if count == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            bytes.extend_from_slice(&part[..count]);
            if bytes.len() > LONGEST {
                return Ok(Err((431, "Request Header Fields Too Large")));
            }
            if let Some(request) = Self::parse(&bytes) {
                return Ok(request);
            }
        }
    }

    /// The request that some bytes are; none as long as they are not all.
    fn parse(bytes: &[u8]) -> Option<Result<Self, Refused>> {
        let mut headers = [httparse::EMPTY_HEADER; HEADERS];
        let mut parsed = httparse::Request::new(&mut headers);
        match parsed.parse(bytes) {
            Ok(httparse::Status::Partial) => return None,
            Ok(httparse::Status::Complete(_)) => {}
            Err(httparse::Error::TooManyHeaders) => {
                return Some(Err((431, "Request Header Fields Too Large")));
            }
            Err(_) => return Some(Err((400, "Bad Request"))),
        }
        if parsed.method != Some("GET") {
            return Some(Err((405, "Method Not Allowed")));
        }
        let header = |name: &str| {
            let mut found = parsed.headers.iter().filter(|own| own.name.eq_ignore_ascii_case(name));
            let first = found.next().map(|own| own.value);
            if found.next().is_some() { Err((400, "Bad Request")) } else { Ok(first) }
        };
        let (host, authorization) = match (header("host"), header("authorization")) {
            (Ok(host), Ok(authorization)) => (host, authorization),
            (Err(refused), _) | (_, Err(refused)) => return Some(Err(refused)),
        };
        let path = parsed.path.unwrap_or_default();
        let path = path.split_once('?').map_or(path, |(path, _)| path);
        Some(Ok(Self {
            path: path.to_owned(),
            host: host.and_then(|host| std::str::from_utf8(host).ok()).map(ToOwned::to_owned),
            authorization: authorization.map(ToOwned::to_owned),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::Request;

    #[test]
    fn requests_are_read_or_refused() {
        let check = |bytes: &str, expected: Option<Result<(&str, Option<&str>), u16>>| {
            let found = Request::parse(bytes.as_bytes());
            let found = found.map(|request| match request {
                Ok(request) => Ok((request.path, request.host)),
                Err((status, _)) => Err(status),
            });
            let expected =
                expected.map(|it| it.map(|(path, host)| (path.to_owned(), host.map(ToOwned::to_owned))));
            assert_eq!(found, expected, "{bytes}");
        };
        check("GET / HTTP/1.1\r\nHost: a:1\r\n\r\n", Some(Ok(("/", Some("a:1")))));
        check("GET /events?x=1 HTTP/1.1\r\n\r\n", Some(Ok(("/events", None))));
        check("GET / HTTP/1.1\r\nHost: a", None);
        check("", None);
        check("POST / HTTP/1.1\r\n\r\n", Some(Err(405)));
        check("GET / HTTP/1.1\r\nHost: a\r\nhost: b\r\n\r\n", Some(Err(400)));
        check("\u{0}\u{1}\r\n\r\n", Some(Err(400)));
        let many = "X: y\r\n".repeat(100);
        check(&format!("GET / HTTP/1.1\r\n{many}\r\n"), Some(Err(431)));
    }
}
