//! HTTP server: answers requests with the page, the picture of the plan, or the event stream.

use std::io;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crate::live::address::{Address, is_local_host};
use crate::live::canvas::Canvas;
use crate::live::http::{Request, Status, respond, send, serve};
use crate::live::hub::{Hub, HubSender, News};
use crate::live::token::Token;
use crate::mapek::{DesignChange, Outlook};
use crate::message::Message;
use crate::report::Painter;

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
    open_connections: Arc<AtomicUsize>,
}

#[derive(Debug)]
struct SharedState {
    hub: Arc<Hub>,
    canvas: Canvas,
    token: Option<Token>,
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
        let shared = Arc::new(SharedState { hub, canvas, token });
        let state = Arc::clone(&shared);
        let open_connections =
            serve(listener, MAX_CONNECTIONS, move |request, stream| answer(&state, request, stream));
        Ok(Self { sender, address, shared, open_connections })
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
        while self.open_connections.load(Ordering::Acquire) > 0 && begun.elapsed() < SHUTDOWN_GRACE {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

fn answer(shared: &SharedState, request: Result<Request, Status>, stream: &mut TcpStream) -> io::Result<()> {
    let request = match request {
        Ok(request) => request,
        Err(status) => return refuse(stream, status),
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

fn authorize(shared: &SharedState, request: &Request) -> Result<(), Status> {
    if let Some(token) = &shared.token {
        let fits = request.authorization.as_deref().is_some_and(|given| token.fits(given));
        return if fits { Ok(()) } else { Err((401, "Unauthorized")) };
    }
    // Without a token, the Host header protects against DNS rebinding.
    let is_local = request.host.as_deref().is_some_and(is_local_host);
    if is_local { Ok(()) } else { Err((403, "Forbidden")) }
}

/// Headers of every response: no content sniffing, no framing, no foreign resources.
const COMMON: &str = "X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
    Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:; \
    base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n";

fn document(stream: &mut TcpStream, kind: &str, text: &str) -> io::Result<()> {
    respond(stream, (200, "OK"), &format!("Content-Type: {kind}; charset=utf-8\r\n{COMMON}"), text)
}

fn refuse(stream: &mut TcpStream, (status, words): Status) -> io::Result<()> {
    let header = match status {
        401 => "WWW-Authenticate: Basic realm=\"metaplan\", charset=\"UTF-8\"\r\n",
        405 => "Allow: GET\r\n",
        _ => "",
    };
    let headers = format!("Content-Type: text/plain; charset=utf-8\r\n{header}{COMMON}");
    respond(stream, (status, words), &headers, &format!("{words}\n"))
}

fn events(shared: &SharedState, stream: &mut TcpStream) -> io::Result<()> {
    send(
        stream,
        &format!(
            "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nConnection: close\r\nCache-Control: no-store\r\n{COMMON}\r\nevent: begin\ndata: {{}}\n\n"
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
