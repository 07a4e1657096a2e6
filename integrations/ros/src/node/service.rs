//! Service servers and service clients.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fmt;
use std::marker::PhantomData;
use std::sync::Arc;
use std::time::{Duration, Instant};

use futures::{FutureExt as _, StreamExt as _};
use metaplan::message::Message;
use ros2_client::ServiceTypeName;
use ros2_client::dds::Client;
use ros2_client::request_id::RmwRequestId;
use smol::{Timer, channel};

use crate::interfaces::{Service, ServiceHashes};
use crate::node::graph::{Expected, Server, Topics};
use crate::node::qos;
use crate::node::reply_gate::ReplyGate;
use crate::node::rmw::Mapping;
use crate::node::{Node, Severity, client_name, creation_error, dds_type};
use crate::types::{AnyService, ServiceType};

/// Time for which the client waits after discovering a server, so that the server can discover the
/// client. Earlier replies would be lost.
const MATCHING_TIME: Duration = Duration::from_millis(100);

/// Sender of the reply to one request. Dropping it without a reply leaves the client waiting.
pub struct Responder<S: Service> {
    id: RmwRequestId,
    answers: channel::Sender<(RmwRequestId, S::Response)>,
}

impl<S: Service> fmt::Debug for Responder<S> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("Responder").field(&self.id.sequence_number).finish()
    }
}

impl<S: Service> Responder<S> {
    /// Sends the reply to the client.
    pub fn send(self, response: S::Response) {
        // The channel is closed if the node no longer exists; the reply is then discarded.
        let _ = self.answers.try_send((self.id, response));
    }
}

/// Reason why a service call returned no reply.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CallError {
    /// The service has no server.
    #[error("{service} has no server after {waited} s")]
    Absent {
        /// Full name of the service.
        service: String,
        /// Time waited, in seconds.
        waited: String,
    },
    /// The server has another type.
    #[error("{service} is not what it should be: {complaint}")]
    Unfit {
        /// Full name of the service.
        service: String,
        /// Difference between the expected and the actual type.
        complaint: String,
    },
    /// The server exists, but the reply did not arrive in time.
    #[error(
        "no answer from {service} after {waited} s; it was called with the service mapping of {mapping}; `--rmw \
         {other}` selects the other mapping"
    )]
    Silent {
        /// Full name of the service.
        service: String,
        /// Time waited, in seconds.
        waited: String,
        /// Middleware whose mapping was used.
        mapping: String,
        /// Value of the option `--rmw` that selects the other mapping.
        other: &'static str,
    },
    /// The reply is not a message of the service's type, the request could not be written, or the client could not be
    /// created.
    #[error("{service}: {because}")]
    Broken {
        /// Full name of the service.
        service: String,
        /// Description of the error.
        because: String,
    },
}

type Connection<S> = (Server, Client<<S as Service>::Request, <S as Service>::Response>);

/// Service client that waits for the reply to each request before it sends the next one.
pub struct Caller<S: Service> {
    node: Arc<Node>,
    full: String,
    topics: Topics,
    kind: ServiceTypeName,
    connection: smol::lock::Mutex<Option<Connection<S>>>,
    service: PhantomData<fn() -> S>,
}

impl<S: Service> fmt::Debug for Caller<S> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("Caller").field(&self.full).finish()
    }
}

impl<S: Service> Caller<S> {
    /// Full name of the service.
    pub fn service(&self) -> &str {
        &self.full
    }

    /// Returns `true` if a server of the service is currently known, even one of another type.
    pub fn is_served(&self) -> bool {
        self.node.graph.server(&self.topics).is_some()
    }

    /// Returns the GUIDs of the request readers of the current servers. A restarted server has a new GUID.
    pub fn servers(&self) -> BTreeSet<[u8; 16]> {
        self.node.graph.readers(&self.topics.requests)
    }

    /// Waits up to `within` for a server and connects to it, so that the first call need not wait
    /// for discovery.
    ///
    /// # Errors
    /// Fails if the service has no server in time, the server has another type, or the client
    /// cannot be created.
    pub async fn ready(&self, within: Duration) -> Result<(), CallError> {
        self.connect(&mut *self.connection.lock().await, within).await.map(|_| ())
    }

    /// Calls the service. `within` limits the time to wait for a server and its reply.
    ///
    /// # Errors
    /// Fails if no valid reply arrives in time.
    pub async fn call(&self, request: S::Request, within: Duration) -> Result<S::Response, CallError> {
        let start = Instant::now();
        let mut connection = self.connection.lock().await;
        let (Server { mapping, .. }, client) = self.connect(&mut connection, within).await?;
        let remaining = within.saturating_sub(start.elapsed());
        let broken = |because: String| CallError::Broken { service: self.full.clone(), because };
        let id = client.async_send_request(request).await.map_err(|error| broken(error.to_string()))?;
        let (mut answer, mut timer) = (
            Box::pin(client.async_receive_response(id)).fuse(),
            futures::FutureExt::fuse(Timer::after(remaining)),
        );
        futures::select! {
            answer = answer => answer.map_err(|error| broken(format!("the answer is malformed: {error}"))),
            _ = timer => Err(CallError::Silent {
                service: self.full.clone(),
                waited: seconds(within),
                mapping: mapping.to_string(),
                other: mapping.other(),
            }),
        }
    }

    /// Returns the current server, and a client with the service mapping of this server.
    async fn connect<'c>(
        &self,
        connection: &'c mut Option<Connection<S>>,
        within: Duration,
    ) -> Result<&'c Connection<S>, CallError> {
        let absent = || CallError::Absent { service: self.full.clone(), waited: seconds(within) };
        let discovered = self.node.graph.wait(within, |graph| graph.server(&self.topics)).await;
        let server = discovered
            .ok_or_else(absent)?
            .map_err(|complaint| CallError::Unfit { service: self.full.clone(), complaint })?;
        let before = connection.take();
        let is_new = before.as_ref().is_none_or(|(connected, _)| *connected != server);
        let client = match before.filter(|(connected, _)| connected.mapping == server.mapping) {
            Some((_, client)) => client,
            None => self.client(server.mapping).map_err(|message| CallError::Broken {
                service: self.full.clone(),
                because: message.message.clone(),
            })?,
        };
        let connected = connection.insert((server, client));
        if is_new {
            Timer::after(MATCHING_TIME.min(within)).await;
        }
        Ok(connected)
    }

    fn client(&self, mapping: Mapping) -> Result<Client<S::Request, S::Response>, Message> {
        let name = client_name(&self.full)?;
        self.node
            .inner()
            .create_client(mapping.service_mapping(), &name, &self.kind, qos::service(), qos::service())
            .map_err(|error| creation_error(&self.full, &error))
    }
}

fn seconds(duration: Duration) -> String {
    format!("{:.1}", duration.as_secs_f64())
}

impl Node {
    /// Creates a client of the service `name`.
    pub fn caller<S: Service>(self: &Arc<Self>, name: &str) -> Caller<S> {
        let hashes = ServiceHashes::of::<S>();
        self.caller_of(name, S::PACKAGE, S::NAME, [hashes.request.into(), hashes.response.into()])
    }

    pub(crate) fn any_caller(self: &Arc<Self>, name: &str, kind: &ServiceType) -> Caller<AnyService> {
        self.caller_of(name, &kind.package, &kind.name, kind.hashes.clone().map(Cow::Owned))
    }

    fn caller_of<S: Service>(
        self: &Arc<Self>,
        name: &str,
        package: &str,
        kind: &str,
        hashes: [Cow<'static, str>; 2],
    ) -> Caller<S> {
        let full = self.resolve(name);
        self.expect_service(&full, package, kind, hashes);
        Caller {
            node: Arc::clone(self),
            topics: Topics::of(&full),
            full,
            kind: ServiceTypeName::new(package, kind),
            connection: smol::lock::Mutex::new(None),
            service: PhantomData,
        }
    }

    /// Serves a service as soon as the service mapping of the middleware is determined. `take`
    /// receives each request and the sender of the reply.
    ///
    /// # Errors
    /// Fails if the name is not a valid service name.
    pub fn serve<S: Service + 'static>(
        self: &Arc<Self>,
        name: &str,
        mut take: impl FnMut(S::Request, Responder<S>) + Send + 'static,
    ) -> Result<(), Message> {
        let full = self.resolve(name);
        let service_name = client_name(&full)?;
        let hashes = ServiceHashes::of::<S>();
        self.expect_service(&full, S::PACKAGE, S::NAME, [hashes.request.into(), hashes.response.into()]);
        let (graph, weak) = (Arc::clone(&self.graph), Arc::downgrade(self));
        self.spawn(async move {
            let mapping = graph.mapping().await;
            let Some(node) = weak.upgrade() else { return };
            let kind = ServiceTypeName::new(S::PACKAGE, S::NAME);
            let created = node.inner().create_server::<S::Request, S::Response>(
                mapping.service_mapping(),
                &service_name,
                &kind,
                qos::service(),
                qos::service(),
            );
            let server = match created {
                Ok(server) => server,
                Err(error) => {
                    node.log(Severity::Fatal, &creation_error(&full, &error).message);
                    return;
                }
            };
            drop(node);
            let (sender, answers) = channel::unbounded();
            let mut requests = Box::pin(server.receive_request_stream());
            let mut answers = Box::pin(answers);
            let mut gate = ReplyGate::new(&full);
            loop {
                while let Some((id, request)) = gate.pop(&graph) {
                    take(request, Responder { id, answers: sender.clone() });
                }
                let mut recheck = Box::pin(gate.recheck()).fuse();
                futures::select! {
                    () = recheck => {}
                    request = requests.next() => match request {
                        Some(Ok((id, request))) => gate.push(id, request),
                        Some(Err(error)) => {
                            let Some(node) = weak.upgrade() else { return };
                            node.log(Severity::Warn, &format!("a request to {full} is malformed: {error}"));
                            drop(node);
                            Timer::after(Duration::from_millis(1)).await;
                        }
                        None => return,
                    },
                    answer = answers.next() => {
                        let Some((id, response)) = answer else { return };
                        if let Err(error) = server.async_send_response(id, response).await
                            && let Some(node) = weak.upgrade()
                        {
                            node.log(Severity::Error, &format!("an answer of {full} could not be written: {error}"));
                        }
                    }
                }
            }
        });
        Ok(())
    }

    fn expect_service(&self, full: &str, package: &str, kind: &str, hashes: [Cow<'static, str>; 2]) {
        let topics = Topics::of(full);
        let type_name = |part: &str| dds_type(package, "srv", &format!("{kind}_{part}"));
        let [request, response] = hashes;
        let request = Expected { type_name: type_name("Request"), hash: request };
        let response = Expected { type_name: type_name("Response"), hash: response };
        self.graph.expect(topics.requests, request);
        self.graph.expect(topics.replies, response);
    }
}
