//! Responses of HTTP/1.1.

use std::io::{self, Write};
use std::sync::Arc;

/// What every response says of itself. Nothing but the page's own files is loaded, and no script or style
/// that stands in a text; no other page may frame it or see its link.
const ALWAYS: &str = "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; \
                      connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; \
                      frame-ancestors 'none'\r\n\
                      X-Content-Type-Options: nosniff\r\n\
                      Referrer-Policy: no-referrer\r\n\
                      Cross-Origin-Resource-Policy: same-origin\r\n";

/// A response.
#[derive(Clone, Debug)]
pub(super) struct Response {
    status: &'static str,
    media_type: &'static str,
    /// Whether the same path has the same body for ever.
    is_lasting: bool,
    body: Arc<[u8]>,
}

impl Response {
    fn new(status: &'static str, media_type: &'static str, body: impl Into<Arc<[u8]>>) -> Self {
        Self { status, media_type, is_lasting: false, body: body.into() }
    }

    /// A file of the page.
    pub(super) fn file(media_type: &'static str, text: &str) -> Self {
        Self::new("200 OK", media_type, text.as_bytes())
    }

    pub(super) fn json(text: &str) -> Self {
        Self::file("application/json", text)
    }

    /// Bytes that a browser may keep.
    pub(super) fn lasting(body: Arc<[u8]>) -> Self {
        Self { is_lasting: true, ..Self::new("200 OK", "application/octet-stream", body) }
    }

    pub(super) fn done() -> Self {
        Self::new("204 No Content", "", Vec::new())
    }

    /// A refusal that says nothing.
    pub(super) fn nothing() -> Self {
        Self::new("404 Not Found", "", Vec::new())
    }

    /// What is wrong with a request.
    pub(super) fn bad(why: &str) -> Self {
        Self::new("400 Bad Request", "text/plain; charset=utf-8", why.as_bytes())
    }

    /// Why a request cannot be answered.
    pub(super) fn failed(why: &str) -> Self {
        Self::new("500 Internal Server Error", "text/plain; charset=utf-8", why.as_bytes())
    }

    /// There are too many connections.
    pub(super) fn busy() -> Self {
        Self::new("503 Service Unavailable", "text/plain; charset=utf-8", "too many connections".as_bytes())
    }

    /// Writes it; a HEAD request gets no body.
    pub(super) fn write(&self, stream: &mut impl Write, has_body: bool, closes: bool) -> io::Result<()> {
        let Self { status, media_type, is_lasting, body } = self;
        let mut head = format!("HTTP/1.1 {status}\r\n{ALWAYS}Content-Length: {}\r\n", body.len());
        if !media_type.is_empty() {
            head += &format!("Content-Type: {media_type}\r\n");
        }
        head += if *is_lasting {
            "Cache-Control: private, max-age=86400, immutable\r\n"
        } else {
            "Cache-Control: no-store\r\n"
        };
        if closes {
            head += "Connection: close\r\n";
        }
        stream.write_all(head.as_bytes())?;
        stream.write_all(b"\r\n")?;
        if has_body {
            stream.write_all(body)?;
        }
        stream.flush()
    }

    /// Writes the head of a stream of events.
    pub(super) fn begin_events(stream: &mut impl Write) -> io::Result<()> {
        let head = format!(
            "HTTP/1.1 200 OK\r\n{ALWAYS}Content-Type: text/event-stream\r\nCache-Control: no-store\r\n\
             Connection: close\r\n\r\nretry: 1000\n\n"
        );
        stream.write_all(head.as_bytes())?;
        stream.flush()
    }
}
