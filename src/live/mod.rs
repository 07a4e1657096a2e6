//! A run as a page of the Web: what the loop hears and answers, as it comes, over HTTP/1.1 \[1\] and server-sent events \[2\].
//!
//! Nothing can be done to the loop from there. [`Live::heard`], [`Live::said`] and [`Live::planned`] never wait: what cannot be taken at once is left out and
//! counted. A bounded number of lines is kept, with the last of each kind that says how things are, so that who comes later sees
//! the state of things. Who reads more slowly than lines go is dropped, and so is who does not read; a browser then comes again by itself.
//!
//! | path | has |
//! |---|---|
//! | `/`, `/live.css`, `/live.js` | the page |
//! | `/plan` | the plan as it was when it was made: timeline, numbers, map |
//! | `/events` | the lines, from the state of things on |
//!
//! Whoever can reach a loopback address may look, unless there is a token; pages of other sites may not (their `Host` is another one).
//! Elsewhere a token is needed, as the password of HTTP's basic authentication with any name, or as a bearer token.
//!
//! - \[1\] RFC 9112, HTTP/1.1, 2022.
//! - \[2\] WHATWG: HTML Living Standard, section 9.2, server-sent events.

mod address;
mod canvas;
mod hub;
mod keep;
mod request;
mod server;
mod token;

pub use address::{Address, DEFAULT_PORT};
pub use server::Live;
pub use token::Token;
