//! TCP connections between servers that can be cut.

use tokio::io::copy_bidirectional;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;

/// `true` while the connections are cut.
#[derive(Debug, Default)]
pub(super) struct Wire(pub(super) watch::Sender<bool>);

impl Wire {
    /// Forwards a new local port to port `to`. Returns the new port.
    pub(super) async fn lead(&self, to: u16) -> u16 {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port is free");
        let port = listener.local_addr().expect("it has an address").port();
        let cut = self.0.subscribe();
        tokio::spawn(async move {
            while let Ok((mut incoming, _)) = listener.accept().await {
                let mut cut = cut.clone();
                tokio::spawn(async move {
                    // Connections to a stopped server are closed, like those over a cut connection.
                    let Ok(mut outgoing) = TcpStream::connect(("127.0.0.1", to)).await else { return };
                    tokio::select! {
                        biased;
                        _ = cut.wait_for(|is_cut| *is_cut) => {}
                        // Either end may close the connection.
                        _ = copy_bidirectional(&mut incoming, &mut outgoing) => {}
                    }
                });
            }
        });
        port
    }
}
