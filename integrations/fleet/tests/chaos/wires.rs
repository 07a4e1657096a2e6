//! The connections between servers, each of which can be cut.

use std::io::{Read as _, Write as _};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// What two servers say to each other goes through here, whoever of them has begun.
#[derive(Debug, Clone, Default)]
pub(super) struct Wire {
    is_cut: Arc<AtomicBool>,
    open: Arc<Mutex<Vec<TcpStream>>>,
}

impl Wire {
    /// Leads from a port, which it returns, to another one.
    pub(super) fn lead(&self, to: u16) -> u16 {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
        let port = listener.local_addr().expect("it has an address").port();
        let own = self.clone();
        std::thread::spawn(move || {
            for incoming in listener.incoming().flatten() {
                // A server that is not there refuses, and so does a wire that is cut.
                let Ok(outgoing) = TcpStream::connect(("127.0.0.1", to)) else { continue };
                let mut open = own.open.lock().unwrap_or_else(PoisonError::into_inner);
                if own.is_cut.load(Ordering::SeqCst) {
                    continue;
                }
                for (from, to) in [(&incoming, &outgoing), (&outgoing, &incoming)] {
                    let (Ok(from), Ok(to)) = (from.try_clone(), to.try_clone()) else { continue };
                    std::thread::spawn(move || carry(from, to));
                }
                open.extend([incoming, outgoing]);
            }
        });
        port
    }

    /// Ends all connections, and lets nobody make new ones.
    pub(super) fn cut(&self) {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        self.is_cut.store(true, Ordering::SeqCst);
        for stream in open.drain(..) {
            // It may have ended.
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// Lets servers connect again.
    pub(super) fn mend(&self) {
        self.is_cut.store(false, Ordering::SeqCst);
    }
}

/// Carries all bytes one way.
fn carry(mut from: TcpStream, mut to: TcpStream) {
    // Either end may be gone.
    let _ = std::io::copy(&mut from, &mut to);
    let _ = to.shutdown(Shutdown::Both);
}

/// What a server says of its connections to other servers; nothing where it does not answer.
pub(super) fn routes(monitor: u16) -> Option<String> {
    let mut stream = TcpStream::connect(("127.0.0.1", monitor)).ok()?;
    stream.set_read_timeout(Some(Duration::from_secs(2))).ok()?;
    stream.write_all(b"GET /routez HTTP/1.0\r\n\r\n").ok()?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer).ok()?;
    answer.contains("200 OK").then_some(answer)
}
