//! HTTP endpoints of the program: `/metrics` for Prometheus, `/live` and `/ready` for probes.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use metaplan::message::Message;
use metaplan_fleet::health::Health;
use metrics_exporter_prometheus::{PrometheusBuilder, PrometheusHandle};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;

const MAX_HEAD_BYTES: usize = 16 << 10;

const MAX_HEADERS: usize = 64;

const MAX_CONNECTIONS: usize = 64;

const TIMEOUT: Duration = Duration::from_secs(5);

const UPKEEP: Duration = Duration::from_secs(5);

type Response = (&'static str, String);

/// Opens the HTTP endpoints at `address`, and serves them in the background until the program ends.
pub(crate) async fn open(address: SocketAddr, health: Arc<Health>) -> Result<(), Message> {
    let wrong = |error: &dyn std::fmt::Display| Message::error("N301", format!("{address}: {error}"));
    let listener = TcpListener::bind(address).await.map_err(|error| wrong(&error))?;
    let metrics = PrometheusBuilder::new().install_recorder().map_err(|error| wrong(&error))?;
    let histograms = metrics.clone();
    tokio::spawn(async move {
        loop {
            tokio::time::sleep(UPKEEP).await;
            histograms.run_upkeep();
        }
    });
    tokio::spawn(async move {
        let connections = Arc::new(Semaphore::new(MAX_CONNECTIONS));
        while let Ok(permit) = Arc::clone(&connections).acquire_owned().await {
            let Ok((stream, _)) = listener.accept().await else {
                // For example, the process has no free file descriptor.
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            };
            let (metrics, health) = (metrics.clone(), Arc::clone(&health));
            tokio::spawn(async move {
                // A client that is slow or has gone needs no response.
                let _ = tokio::time::timeout(TIMEOUT, respond(stream, &metrics, &health)).await;
                drop(permit);
            });
        }
    });
    Ok(())
}

async fn respond(mut stream: TcpStream, metrics: &PrometheusHandle, health: &Health) -> io::Result<()> {
    let mut bytes = Vec::new();
    let (status, body) = loop {
        let mut part = [0; 2048];
        let count = stream.read(&mut part).await?;
        if count == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        bytes.extend_from_slice(&part[..count]);
        if bytes.len() > MAX_HEAD_BYTES {
            break ("431 Request Header Fields Too Large", String::new());
        }
        if let Some(path) = path(&bytes) {
            break path.map_or_else(|status| (status, String::new()), |path| page(&path, metrics, health));
        }
    };
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\nContent-Length: {}\r\n\
         Cache-Control: no-store\r\nConnection: close\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes()).await?;
    stream.write_all(body.as_bytes()).await?;
    stream.shutdown().await
}

/// Parses a request and returns its path, or the status for a request that is not valid. Returns `None`
/// while the request is incomplete.
fn path(bytes: &[u8]) -> Option<Result<String, &'static str>> {
    let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(bytes) {
        Ok(httparse::Status::Partial) => None,
        Ok(httparse::Status::Complete(_)) if request.method == Some("GET") => {
            let path = request.path.unwrap_or_default();
            Some(Ok(path.split_once('?').map_or(path, |(path, _)| path).to_owned()))
        }
        Ok(httparse::Status::Complete(_)) => Some(Err("405 Method Not Allowed")),
        Err(_) => Some(Err("400 Bad Request")),
    }
}

fn page(path: &str, metrics: &PrometheusHandle, health: &Health) -> Response {
    match path {
        "/metrics" | "/" => ("200 OK", metrics.render()),
        // `/health` is the former name of `/live`.
        "/live" | "/health" if health.is_live() => ("200 OK", "OK\n".to_owned()),
        "/live" | "/health" => ("503 Service Unavailable", "the worker's main loop hangs\n".to_owned()),
        "/ready" => match health.is_ready() {
            Ok(()) => ("200 OK", "OK\n".to_owned()),
            Err(reason) => ("503 Service Unavailable", format!("{reason}\n")),
        },
        _ => ("404 Not Found", "there are /metrics, /live and /ready\n".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::path;

    #[test]
    fn requests_are_parsed_or_rejected() {
        for (bytes, expected) in [
            ("GET /live HTTP/1.1\r\n", None),
            ("GET /live HTTP/1.1\r\n\r\n", Some(Ok("/live"))),
            ("GET /ready?verbose HTTP/1.0\r\nHost: x\r\n\r\n", Some(Ok("/ready"))),
            ("POST /live HTTP/1.1\r\n\r\n", Some(Err("405 Method Not Allowed"))),
            ("\u{1}nonsense\r\n\r\n", Some(Err("400 Bad Request"))),
        ] {
            let expected = expected.map(|path| path.map(str::to_owned));
            assert_eq!(path(bytes.as_bytes()), expected, "{bytes:?}");
        }
        let many = format!("GET / HTTP/1.1\r\n{}\r\n", "A: b\r\n".repeat(100));
        assert_eq!(path(many.as_bytes()), Some(Err("400 Bad Request")));
    }
}
