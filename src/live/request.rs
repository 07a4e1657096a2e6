//! Parses HTTP requests: the path without its query, and the headers `Host` and `Authorization`.

use std::io::{self, Read};
use std::net::TcpStream;
use std::time::{Duration, Instant};

const MAX_HEAD_BYTES: usize = 16 << 10;

const MAX_HEADERS: usize = 64;

#[derive(Debug, PartialEq, Eq)]
pub(super) struct Request {
    pub(super) path: String,
    pub(super) host: Option<String>,
    pub(super) authorization: Option<Vec<u8>>,
}

/// Reason for rejecting a request: status code and reason phrase.
pub(super) type Refused = (u16, &'static str);

impl Request {
    /// Reads a request from a connection. Returns a status code for a request that is malformed, too large, or not a
    /// GET request. If the request is not complete within `patience`, returns status 408 or a timeout error.
    pub(super) fn read(stream: &mut TcpStream, patience: Duration) -> io::Result<Result<Self, Refused>> {
        let begun = Instant::now();
        let mut bytes = Vec::new();
        let mut part = [0; 2048];
        loop {
            let timeout = patience.saturating_sub(begun.elapsed());
            if timeout.is_zero() {
                return Ok(Err((408, "Request Timeout")));
            }
            stream.set_read_timeout(Some(timeout))?;
            let count = stream.read(&mut part)?;
            if count == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            bytes.extend_from_slice(&part[..count]);
            if bytes.len() > MAX_HEAD_BYTES {
                return Ok(Err((431, "Request Header Fields Too Large")));
            }
            if let Some(request) = Self::parse(&bytes) {
                return Ok(request);
            }
        }
    }

    fn parse(bytes: &[u8]) -> Option<Result<Self, Refused>> {
        let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
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
            let mut values = parsed.headers.iter().filter(|header| header.name.eq_ignore_ascii_case(name));
            let first = values.next().map(|header| header.value);
            if values.next().is_some() { Err((400, "Bad Request")) } else { Ok(first) }
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
    fn requests_are_parsed_or_rejected() {
        let check = |bytes: &str, expected: Option<Result<(&str, Option<&str>), u16>>| {
            let request = Request::parse(bytes.as_bytes());
            let request = request.map(|request| match request {
                Ok(request) => Ok((request.path, request.host)),
                Err((status, _)) => Err(status),
            });
            let expected =
                expected.map(|it| it.map(|(path, host)| (path.to_owned(), host.map(ToOwned::to_owned))));
            assert_eq!(request, expected, "{bytes}");
        };
        check("GET / HTTP/1.1\r\nHost: a:1\r\n\r\n", Some(Ok(("/", Some("a:1")))));
        check("GET /events?x=1 HTTP/1.1\r\n\r\n", Some(Ok(("/events", None))));
        check("GET / HTTP/1.1\r\nHost: a", None);
        check("", None);
        check("POST / HTTP/1.1\r\n\r\n", Some(Err(405)));
        check("GET / HTTP/1.1\r\nHost: a\r\nhost: b\r\n\r\n", Some(Err(400)));
        check("\u{0}\u{1}\r\n\r\n", Some(Err(400)));
        let headers = "X: y\r\n".repeat(100);
        check(&format!("GET / HTTP/1.1\r\n{headers}\r\n"), Some(Err(431)));
    }
}
