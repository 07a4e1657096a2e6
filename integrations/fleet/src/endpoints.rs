//! HTTP endpoints of the program: `/metrics` for Prometheus, `/live` and `/ready` for probes.

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::time::Duration;

use metaplan::live::http::{Status, respond, serve};
use metaplan::message::Message;
use metaplan_fleet::health::Health;
use metrics_exporter_prometheus::{PrometheusBuilder, PrometheusHandle};

const MAX_CONNECTIONS: usize = 64;

const UPKEEP: Duration = Duration::from_secs(5);

/// Opens the HTTP endpoints at `address`, and serves them in the background until the program ends.
pub(crate) fn open(address: SocketAddr, health: Arc<Health>) -> Result<(), Message> {
    let wrong = |error: &dyn std::fmt::Display| Message::error("N301", format!("{address}: {error}"));
    let listener = TcpListener::bind(address).map_err(|error| wrong(&error))?;
    let metrics = PrometheusBuilder::new().install_recorder().map_err(|error| wrong(&error))?;
    let histograms = metrics.clone();
    tokio::spawn(async move {
        loop {
            tokio::time::sleep(UPKEEP).await;
            histograms.run_upkeep();
        }
    });
    serve(listener, MAX_CONNECTIONS, move |request, stream| {
        let (status, text) = match request {
            Ok(request) => page(&request.path, &metrics, &health),
            Err(status) => (status, format!("{}\n", status.1)),
        };
        respond(stream, status, "Content-Type: text/plain; version=0.0.4; charset=utf-8\r\n", &text)
    });
    Ok(())
}

fn page(path: &str, metrics: &PrometheusHandle, health: &Health) -> (Status, String) {
    const UNAVAILABLE: Status = (503, "Service Unavailable");
    match path {
        "/metrics" | "/" => ((200, "OK"), metrics.render()),
        // `/health` is the former name of `/live`.
        "/live" | "/health" if health.is_live() => ((200, "OK"), "OK\n".to_owned()),
        "/live" | "/health" => (UNAVAILABLE, "the worker's main loop hangs\n".to_owned()),
        "/ready" => match health.is_ready() {
            Ok(()) => ((200, "OK"), "OK\n".to_owned()),
            Err(reason) => (UNAVAILABLE, format!("{reason}\n")),
        },
        _ => ((404, "Not Found"), "there are /metrics, /live and /ready\n".to_owned()),
    }
}
