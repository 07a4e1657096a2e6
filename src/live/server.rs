//! Connections to answers: the page, and the lines for as long as somebody reads them.

use std::io::{self, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crate::live::address::{Address, is_local_host};
use crate::live::canvas::Canvas;
use crate::live::hub::{Hub, Mouth, News};
use crate::live::request::{Refused, Request};
use crate::live::token::Token;
use crate::mapek::{DesignChange, Outlook};
use crate::message::Message;
use crate::report::Painter;

/// So long somebody may take to ask, and to take what was sent.
const PATIENCE: Duration = Duration::from_secs(5);

/// After so long without a line it is said that all is well.
const QUIET: Duration = Duration::from_secs(10);

/// So many may look at once.
const VISITORS: usize = 16;

/// At the end of a run they are given so long to see it.
const FAREWELL: Duration = Duration::from_millis(500);

const PAGE: &str = include_str!("page/index.html");
/// The style of this page, in addition to that of all.
const STYLE: &str = include_str!("page/live.css");
const SCRIPT: &str = include_str!("page/live.js");

/// A run that can be looked at; copies are the same one.
#[derive(Debug, Clone)]
pub struct Live {
    mouth: Mouth,
    address: SocketAddr,
    house: Arc<House>,
}

/// What all connections share.
#[derive(Debug)]
struct House {
    hub: Arc<Hub>,
    canvas: Canvas,
    token: Option<Token>,
    visitors: AtomicUsize,
}

impl Live {
    /// Begins to serve. Where other machines can reach, there has to be a token. Without a painter no plan is drawn.
    ///
    /// # Errors
    /// There is none, or nothing can be served there.
    pub fn open(address: Address, token: Option<Token>, painter: Option<Painter>) -> Result<Self, Message> {
        if !address.is_loopback() && token.is_none() {
            let text = format!("who can reach {} can look at the run: a token is needed there", address.0);
            return Err(Message::error("M332", text));
        }
        let failed = |error: io::Error| {
            Message::error("M332", format!("nothing can be served at {}: {error}", address.0))
        };
        let listener = TcpListener::bind(address.0).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let hub = Arc::new(Hub::default());
        let mouth = Mouth::of(Arc::clone(&hub));
        let canvas = Canvas::new(painter);
        let house = Arc::new(House { hub, canvas, token, visitors: AtomicUsize::new(0) });
        let own = Arc::clone(&house);
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                match stream {
                    Ok(stream) => receive(&own, stream),
                    // As where there are too many open files: others may be closed meanwhile.
                    Err(_) => std::thread::sleep(Duration::from_millis(50)),
                }
            }
        });
        Ok(Self { mouth, address, house })
    }

    /// Where it is served.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Takes a line that the loop has heard, with its number. This never waits.
    pub fn heard(&self, number: u64, text: &str) {
        self.mouth.heard(number, text);
    }

    /// Takes an answer, which is an object of the format as JSON. This never waits.
    pub fn said(&self, answer: &str) {
        self.mouth.answer(answer);
    }

    /// Takes how designs are, before anything is answered. This never waits.
    pub fn known(&self, designs: Vec<DesignChange>) {
        self.mouth.known(designs);
    }

    /// Takes another plan, or that there is none any more. This never waits, and nothing is drawn before somebody looks.
    pub fn planned(&self, outlook: Option<Outlook>) {
        let under_way = outlook.as_ref().filter(|own| own.is_under_way).map(|own| own.first);
        let exists = outlook.is_some();
        self.house.canvas.take(outlook);
        self.mouth.planned(exists, under_way);
    }

    /// Ends the run for those who look, who are given a moment to see the end.
    pub fn end(&self) {
        self.mouth.end();
        let begun = Instant::now();
        while self.house.visitors.load(Ordering::Acquire) > 0 && begun.elapsed() < FAREWELL {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

/// A visitor, as long as he is there.
struct Visit(Arc<House>);

impl Drop for Visit {
    fn drop(&mut self) {
        self.0.visitors.fetch_sub(1, Ordering::AcqRel);
    }
}

/// Gives a connection a thread, if there are not too many.
fn receive(house: &Arc<House>, mut stream: TcpStream) {
    let others = house.visitors.fetch_add(1, Ordering::AcqRel);
    let visit = Visit(Arc::clone(house));
    let is_full = others >= VISITORS;
    let answered = std::thread::Builder::new().spawn(move || {
        // Who has gone away needs no answer.
        let _ = if is_full {
            refuse(&mut stream, (503, "Service Unavailable"))
        } else {
            answer(&visit.0, &mut stream)
        };
        let _ = stream.shutdown(Shutdown::Both);
        drop(visit);
    });
    // Without a thread the connection is closed, and the visit is over.
    drop(answered);
}

/// Answers one request.
fn answer(house: &House, stream: &mut TcpStream) -> io::Result<()> {
    stream.set_nodelay(true)?;
    let request = match Request::read(stream, PATIENCE)? {
        Ok(request) => request,
        Err(refused) => return refuse(stream, refused),
    };
    if let Err(refused) = may_look(house, &request) {
        return refuse(stream, refused);
    }
    match request.path.as_str() {
        "/" => document(stream, "text/html", PAGE),
        "/live.css" => document(stream, "text/css", &[picture::STYLE, STYLE].concat()),
        "/plan" => document(stream, "text/html", &house.canvas.picture()),
        "/live.js" => document(stream, "text/javascript", SCRIPT),
        "/events" => events(house, stream),
        _ => refuse(stream, (404, "Not Found")),
    }
}

/// Whether a request comes from somebody who may look.
fn may_look(house: &House, request: &Request) -> Result<(), Refused> {
    if let Some(token) = &house.token {
        let fits = request.authorization.as_deref().is_some_and(|given| token.fits(given));
        return if fits { Ok(()) } else { Err((401, "Unauthorized")) };
    }
    let is_local = request.host.as_deref().is_some_and(is_local_host);
    if is_local { Ok(()) } else { Err((403, "Forbidden")) }
}

/// What stands in the head of every answer: nothing is kept, guessed, framed or fetched from elsewhere.
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
    let more = match status {
        401 => "WWW-Authenticate: Basic realm=\"metaplan\", charset=\"UTF-8\"\r\n",
        405 => "Allow: GET\r\n",
        _ => "",
    };
    let text = format!("{words}\n");
    let length = text.len();
    let kind = "text/plain; charset=utf-8";
    let head = format!(
        "HTTP/1.1 {status} {words}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n{more}{COMMON}\r\n"
    );
    send(stream, &(head + &text))
}

/// Sends the state of things, and then what comes, until the run ends or somebody does not follow.
fn events(house: &House, stream: &mut TcpStream) -> io::Result<()> {
    send(
        stream,
        &format!(
            "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\n{COMMON}\r\nevent: begin\ndata: {{}}\n\n"
        ),
    )?;
    let (state, mut next) = house.hub.state();
    for batch in state.chunks(100) {
        send(stream, &stanzas(batch))?;
    }
    loop {
        match house.hub.news(next, QUIET) {
            News::Lines(lines) => {
                send(stream, &stanzas(&lines))?;
                next += lines.len() as u64;
            }
            News::Nothing => send(stream, ":\n\n")?,
            News::Missed => return Ok(()),
            News::Ended => return send(stream, "event: end\ndata: {}\n\n"),
        }
    }
}

fn stanzas(lines: &[Arc<str>]) -> String {
    lines.iter().flat_map(|line| ["data: ", line, "\n\n"]).collect()
}

/// Sends a text to somebody who takes all of it in time.
fn send(stream: &mut TcpStream, text: &str) -> io::Result<()> {
    let begun = Instant::now();
    let mut rest = text.as_bytes();
    while !rest.is_empty() {
        let left = PATIENCE.saturating_sub(begun.elapsed());
        if left.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        stream.set_write_timeout(Some(left))?;
        match stream.write(rest) {
            Ok(count) => rest = &rest[count..],
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}
