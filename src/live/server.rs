//! HTTP server: answers requests with the page, the picture of the plan, or the event stream.

use std::io::{self, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crate::live::address::{Address, is_local_host};
use crate::live::canvas::Canvas;
use crate::live::hub::{Hub, HubSender, News};
use crate::live::request::{Refused, Request};
use crate::live::token::Token;
use crate::mapek::{DesignChange, Outlook};
use crate::message::Message;
use crate::report::Painter;

/// Time limit for reading a request, and for sending each text.
const CLIENT_TIMEOUT: Duration = Duration::from_secs(5);

const KEEPALIVE_INTERVAL: Duration = Duration::from_secs(10);

const MAX_CONNECTIONS: usize = 16;

const SHUTDOWN_GRACE: Duration = Duration::from_millis(500);

const PAGE: &str = include_str!("page/index.html");
const STYLE: &str = include_str!("page/live.css");
const SCRIPT: &str = include_str!("page/live.js");

/// Server of the web page for one run. Clones share the server.
#[derive(Debug, Clone)]
pub struct Live {
    sender: HubSender,
    address: SocketAddr,
    shared: Arc<SharedState>,
}

#[derive(Debug)]
struct SharedState {
    hub: Arc<Hub>,
    canvas: Canvas,
    token: Option<Token>,
    open_connections: AtomicUsize,
}

impl Live {
    /// Starts the server. A token is required unless the address is a loopback address. Without
    /// `painter`, plans are not drawn.
    ///
    /// # Errors
    /// The token is missing, or the server cannot listen on the address.
    pub fn open(address: Address, token: Option<Token>, painter: Option<Painter>) -> Result<Self, Message> {
        // Other machines on the network could otherwise read the run.
        if !address.is_loopback() && token.is_none() {
            let text =
                format!("every machine that can reach {} could see the run: a token is required", address.0);
            return Err(Message::error("M332", text));
        }
        let failed = |error: io::Error| {
            Message::error("M332", format!("the server cannot listen on {}: {error}", address.0))
        };
        let listener = TcpListener::bind(address.0).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let hub = Arc::new(Hub::default());
        let sender = HubSender::of(Arc::clone(&hub));
        let canvas = Canvas::new(painter);
        let shared = Arc::new(SharedState { hub, canvas, token, open_connections: AtomicUsize::new(0) });
        let accepting = Arc::clone(&shared);
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                match stream {
                    Ok(stream) => receive(&accepting, stream),
                    // The error may be temporary, for example too many open files until other
                    // connections close.
                    Err(_) => std::thread::sleep(Duration::from_millis(50)),
                }
            }
        });
        Ok(Self { sender, address, shared })
    }

    /// Returns the address of the server.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Publishes an input line of the loop, with its number. Never blocks.
    pub fn heard(&self, number: u64, text: &str) {
        self.sender.send_event(number, text);
    }

    /// Publishes an answer of the loop, as the text of its JSON object. Never blocks.
    pub fn said(&self, answer: &str) {
        self.sender.send_answer(answer);
    }

    /// Publishes the availability of the designs at the start of the loop. Never blocks.
    pub fn known(&self, designs: Vec<DesignChange>) {
        self.sender.send_designs(designs);
    }

    /// Replaces the current plan, or removes it. Never blocks; the plan is drawn when its picture is next requested.
    pub fn planned(&self, outlook: Option<Outlook>) {
        let under_way = outlook.as_ref().filter(|plan| plan.is_under_way).map(|plan| plan.first);
        let exists = outlook.is_some();
        self.shared.canvas.take(outlook);
        self.sender.send_plan(exists, under_way);
    }

    /// Reports the end of the run to all clients, and waits up to half a second until they have received it.
    pub fn end(&self) {
        self.sender.end();
        let begun = Instant::now();
        while self.shared.open_connections.load(Ordering::Acquire) > 0 && begun.elapsed() < SHUTDOWN_GRACE {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

struct ConnectionGuard(Arc<SharedState>);

impl Drop for ConnectionGuard {
    fn drop(&mut self) {
        self.0.open_connections.fetch_sub(1, Ordering::AcqRel);
    }
}

/// Answers a connection on a new thread, or with status 503 if there are too many connections.
fn receive(shared: &Arc<SharedState>, mut stream: TcpStream) {
    let connections = shared.open_connections.fetch_add(1, Ordering::AcqRel);
    let guard = ConnectionGuard(Arc::clone(shared));
    if connections >= MAX_CONNECTIONS {
        // The short text fits into the empty send buffer of a new connection, so nothing blocks.
        let _ = stream.set_nonblocking(true);
        let _ = refuse(&mut stream, (503, "Service Unavailable"));
        let _ = stream.shutdown(Shutdown::Both);
        return;
    }
    let answered = std::thread::Builder::new().spawn(move || {
        // A write error means that the client has disconnected.
        let _ = answer(&guard.0, &mut stream);
        let _ = stream.shutdown(Shutdown::Both);
        drop(guard);
    });
    // If no thread could be started, the connection is closed and its guard is dropped.
    drop(answered);
}

fn answer(shared: &SharedState, stream: &mut TcpStream) -> io::Result<()> {
    stream.set_nodelay(true)?;
    let request = match Request::read(stream, CLIENT_TIMEOUT)? {
        Ok(request) => request,
        Err(refused) => return refuse(stream, refused),
    };
    if let Err(refused) = authorize(shared, &request) {
        return refuse(stream, refused);
    }
    match request.path.as_str() {
        "/" => document(stream, "text/html", PAGE),
        "/live.css" => document(stream, "text/css", &[picture::STYLE, STYLE].concat()),
        "/plan" => document(stream, "text/html", &shared.canvas.picture()),
        "/live.js" => document(stream, "text/javascript", SCRIPT),
        "/events" => events(shared, stream),
        _ => refuse(stream, (404, "Not Found")),
    }
}

fn authorize(shared: &SharedState, request: &Request) -> Result<(), Refused> {
    if let Some(token) = &shared.token {
        let fits = request.authorization.as_deref().is_some_and(|given| token.fits(given));
        return if fits { Ok(()) } else { Err((401, "Unauthorized")) };
    }
    // Without a token, the Host header protects against DNS rebinding.
    let is_local = request.host.as_deref().is_some_and(is_local_host);
    if is_local { Ok(()) } else { Err((403, "Forbidden")) }
}

/// Headers of every response: no caching, no content sniffing, no framing, no foreign resources.
const COMMON: &str = "Connection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
    Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:; \
    base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n";

fn document(stream: &mut TcpStream, kind: &str, text: &str) -> io::Result<()> {
    let length = text.len();
    let head = format!(
        "HTTP/1.1 200 OK\r\nContent-Type: {kind}; charset=utf-8\r\nContent-Length: {length}\r\n{COMMON}\r\n"
    );
    send(stream, &(head + text))
}

fn refuse(stream: &mut TcpStream, (status, words): Refused) -> io::Result<()> {
    let headers = match status {
        401 => "WWW-Authenticate: Basic realm=\"metaplan\", charset=\"UTF-8\"\r\n",
        405 => "Allow: GET\r\n",
        _ => "",
    };
    let text = format!("{words}\n");
    let length = text.len();
    let kind = "text/plain; charset=utf-8";
    let head = format!(
        "HTTP/1.1 {status} {words}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n{headers}{COMMON}\r\n"
    );
    send(stream, &(head + &text))
}

fn events(shared: &SharedState, stream: &mut TcpStream) -> io::Result<()> {
    send(
        stream,
        &format!(
            "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\n{COMMON}\r\nevent: begin\ndata: {{}}\n\n"
        ),
    )?;
    let (state, mut next) = shared.hub.state();
    for batch in state.chunks(100) {
        send(stream, &stanzas(batch))?;
    }
    loop {
        match shared.hub.news(next, KEEPALIVE_INTERVAL) {
            News::Lines(lines) => {
                send(stream, &stanzas(&lines))?;
                next += lines.len() as u64;
            }
            // A comment keeps the connection alive and detects disconnected clients.
            News::Nothing => send(stream, ":\n\n")?,
            // The browser reconnects and then receives the current state.
            News::Missed => return Ok(()),
            News::Ended => return send(stream, "event: end\ndata: {}\n\n"),
        }
    }
}

fn stanzas(lines: &[Arc<str>]) -> String {
    lines.iter().flat_map(|line| ["data: ", line, "\n\n"]).collect()
}

fn send(stream: &mut TcpStream, text: &str) -> io::Result<()> {
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
