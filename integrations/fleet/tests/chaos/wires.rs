//! TCP connections between servers that can be cut.

use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

#[derive(Debug, Clone, Default)]
pub(super) struct Wire {
    is_cut: Arc<AtomicBool>,
    open: Arc<Mutex<Vec<TcpStream>>>,
}

impl Wire {
    /// Forwards a new local port to port `to`. Returns the new port.
    pub(super) fn lead(&self, to: u16) -> u16 {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
        let port = listener.local_addr().expect("it has an address").port();
        let own = self.clone();
        std::thread::spawn(move || {
            for incoming in listener.incoming().flatten() {
                // Connections to a stopped server are closed, like those over a cut connection.
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

    pub(super) fn cut(&self) {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        self.is_cut.store(true, Ordering::SeqCst);
        for stream in open.drain(..) {
            // The connection may already be closed.
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    pub(super) fn mend(&self) {
        self.is_cut.store(false, Ordering::SeqCst);
    }
}

fn carry(mut from: TcpStream, mut to: TcpStream) {
    // Either end may be closed.
    let _ = std::io::copy(&mut from, &mut to);
    let _ = to.shutdown(Shutdown::Both);
}
