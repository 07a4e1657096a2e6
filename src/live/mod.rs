//! Web page that shows a running loop: its events and answers, over HTTP/1.1 \[1\] and server-sent events \[2\].
//!
//! The page cannot influence the loop. [`Live::heard`], [`Live::said`], [`Live::known`] and [`Live::planned`] never
//! block: lines that exceed the queue are dropped and counted. A bounded number of lines is retained, including the
//! last line for each part of the current state, so that later clients also receive the state. A client that reads too
//! slowly is disconnected; a browser then reconnects automatically.
//!
//! | path | content |
//! |---|---|
//! | `/`, `/live.css`, `/live.js` | the page |
//! | `/plan` | picture of the plan that was last adopted: timeline, numbers, map |
//! | `/events` | the current state, the retained lines, then all new lines |
//!
//! On a loopback address, local clients need no token unless one is configured. Without a token, a request is rejected
//! unless its `Host` header names this machine, which prevents DNS rebinding. On any other address a token is required.
//! The client sends the token as the password of HTTP basic authentication with any user name, or as a bearer token.
//!
//! - \[1\] RFC 9112, HTTP/1.1, 2022.
//! - \[2\] WHATWG: HTML Living Standard, section 9.2, server-sent events.

mod address;
mod canvas;
pub mod http;
mod hub;
mod keep;
mod server;
mod token;

pub use address::{Address, DEFAULT_PORT};
pub use server::Live;
pub use token::Token;
