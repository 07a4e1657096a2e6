//! HTTP endpoints of the program: `/metrics` for Prometheus, `/live` and `/ready` for probes.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use metaplan::message::Message;
use metaplan_fleet::health::Health;
use metrics_exporter_prometheus::{PrometheusBuilder, PrometheusHandle};
use tokio::io::{AsyncBufReadExt as _, AsyncReadExt as _, AsyncWriteExt as _, BufReader};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;

const MAX_HEAD_BYTES: u64 = 16 << 10;

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
    let (reader, mut writer) = stream.split();
    let mut lines = BufReader::new(reader.take(MAX_HEAD_BYTES)).lines();
    let request = lines.next_line().await?.unwrap_or_default();
    // The headers end with an empty line.
    while lines.next_line().await?.is_some_and(|line| !line.is_empty()) {}
    let (status, body) =
        path(&request).map_or_else(|status| (status, String::new()), |path| page(path, metrics, health));
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\nContent-Length: {}\r\n\
         Cache-Control: no-store\r\nConnection: close\r\n\r\n",
        body.len()
    );
    writer.write_all(head.as_bytes()).await?;
    writer.write_all(body.as_bytes()).await?;
    writer.shutdown().await
}

/// Returns the path in the first line of a request, or the status for a request that is not valid.
fn path(request: &str) -> Result<&str, &'static str> {
    let words: Vec<&str> = request.split(' ').collect();
    match words.as_slice() {
        ["GET", path, "HTTP/1.0" | "HTTP/1.1"] => Ok(path.split('?').next().unwrap_or_default()),
        [_, _, "HTTP/1.0" | "HTTP/1.1"] => Err("405 Method Not Allowed"),
        _ => Err("400 Bad Request"),
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
        for (request, expected) in [
            ("GET /live HTTP/1.1", Ok("/live")),
            ("GET /ready?verbose HTTP/1.0", Ok("/ready")),
            ("POST /live HTTP/1.1", Err("405 Method Not Allowed")),
            ("GET /live", Err("400 Bad Request")),
            ("\u{1}nonsense", Err("400 Bad Request")),
        ] {
            assert_eq!(path(request), expected, "{request:?}");
        }
    }
}
