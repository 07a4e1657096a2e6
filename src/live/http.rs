//! Small HTTP/1.1 server for GET requests. Each connection has one request and one thread. The number of connections, the
//! length of a request and the times of reading and writing are bounded.

use std::io::{self, Read as _, Write as _};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Time limit for reading a request, and for sending each text.
const CLIENT_TIMEOUT: Duration = Duration::from_secs(5);

const MAX_HEAD_BYTES: usize = 16 << 10;

const MAX_HEADERS: usize = 64;

/// A request: the path without its query, and the headers `Host` and `Authorization`.
#[derive(Debug, PartialEq, Eq)]
pub struct Request {
    /// Path without the query.
    pub path: String,
    /// The header `Host`, if the request has it.
    pub host: Option<String>,
    /// The header `Authorization`, if the request has it.
    pub authorization: Option<Vec<u8>>,
}

/// Status code and reason phrase.
pub type Status = (u16, &'static str);

/// Answers each connection on a new thread, in the background until the program ends. `answer` gets the request, or
/// the status for a request that is malformed, too large, late, or not a GET request. If there are more than
/// `max_connections`, the status is 503. Returns the number of open connections.
pub fn serve(
    listener: TcpListener,
    max_connections: usize,
    answer: impl Fn(Result<Request, Status>, &mut TcpStream) -> io::Result<()> + Send + Sync + 'static,
) -> Arc<AtomicUsize> {
    let open_connections = Arc::<AtomicUsize>::default();
    let (answer, counter) = (Arc::new(answer), Arc::clone(&open_connections));
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let Ok(mut stream) = stream else {
                // The error may be temporary, for example too many open files until other
                // connections close.
                std::thread::sleep(Duration::from_millis(50));
                continue;
            };
            let is_full = counter.fetch_add(1, Ordering::AcqRel) >= max_connections;
            let (answer, guard) = (Arc::clone(&answer), ConnectionGuard(Arc::clone(&counter)));
            if is_full {
                // The short text fits into the empty send buffer of a new connection, so nothing blocks.
                let _ = stream.set_nonblocking(true);
                let _ = answer(Err((503, "Service Unavailable")), &mut stream);
                let _ = stream.shutdown(Shutdown::Both);
                continue;
            }
            let answered = std::thread::Builder::new().spawn(move || {
                // An error means that the client has disconnected.
                let _ = Request::read(&mut stream, CLIENT_TIMEOUT)
                    .and_then(|request| answer(request, &mut stream));
                let _ = stream.shutdown(Shutdown::Both);
                drop(guard);
            });
            // If no thread could be started, the connection is closed and its guard is dropped.
            drop(answered);
        }
    });
    open_connections
}

struct ConnectionGuard(Arc<AtomicUsize>);

impl Drop for ConnectionGuard {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

/// Sends a response, which is not cached. `headers` are further lines, each with its end.
///
/// # Errors
/// The client has disconnected, or reads too slowly.
pub fn respond(stream: &mut TcpStream, (status, words): Status, headers: &str, text: &str) -> io::Result<()> {
    let length = text.len();
    let head = format!(
        "HTTP/1.1 {status} {words}\r\nContent-Length: {length}\r\nConnection: close\r\nCache-Control: no-store\r\n{headers}\r\n"
    );
    send(stream, &(head + text))
}

pub(super) fn send(stream: &mut TcpStream, text: &str) -> io::Result<()> {
    let begun = Instant::now();
    let mut remaining = text.as_bytes();
    while !remaining.is_empty() {
        // The timeout applies to the whole text, not to each write.
        let timeout = CLIENT_TIMEOUT.saturating_sub(begun.elapsed());
        if timeout.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        stream.set_write_timeout(Some(timeout))?;
        match stream.write(remaining) {
            Ok(count) => remaining = &remaining[count..],
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

impl Request {
    /// Reads a request from a connection. Returns a status code for a request that is malformed, too large, or not a
    /// GET request. If the request is not complete within `patience`, returns status 408 or a timeout error.
    fn read(stream: &mut TcpStream, patience: Duration) -> io::Result<Result<Self, Status>> {
        stream.set_nodelay(true)?;
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

    fn parse(bytes: &[u8]) -> Option<Result<Self, Status>> {
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
        check("GET /ready?verbose HTTP/1.0\r\n\r\n", Some(Ok(("/ready", None))));
        check("GET / HTTP/1.1\r\nHost: a", None);
        check("", None);
        check("POST / HTTP/1.1\r\n\r\n", Some(Err(405)));
        check("GET / HTTP/1.1\r\nHost: a\r\nhost: b\r\n\r\n", Some(Err(400)));
        check("\u{0}\u{1}\r\n\r\n", Some(Err(400)));
        check("GET /live\r\n\r\n", Some(Err(400)));
        let headers = "X: y\r\n".repeat(100);
        check(&format!("GET / HTTP/1.1\r\n{headers}\r\n"), Some(Err(431)));
    }
}
