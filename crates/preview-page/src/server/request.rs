//! Requests of HTTP/1.1: their heads, and the text of their bodies.

use std::io::{self, BufRead, Read};

/// The most bytes of a head, and the most lines in it.
const MAX_HEAD: usize = 16 << 10;
const MAX_LINES: usize = 64;

/// The most bytes of a body that is text.
const MAX_TEXT: u64 = 1 << 20;

/// The head of a request.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Head {
    pub(super) method: String,
    pub(super) path: String,
    pub(super) host: Option<String>,
    pub(super) origin: Option<String>,
    pub(super) last_event: Option<u64>,
    pub(super) length: u64,
    /// Whether the other side waits before it sends the body.
    pub(super) waits: bool,
    /// Whether the connection ends with this request.
    pub(super) closes: bool,
}

impl Head {
    /// Reads the next head; `None` if there is none.
    ///
    /// # Errors
    /// [`io::ErrorKind::InvalidData`] if it is none of HTTP/1.1 or too long, others if it cannot be read.
    pub(super) fn read(stream: &mut impl BufRead) -> io::Result<Option<Self>> {
        let mut bytes = Vec::new();
        while !bytes.ends_with(b"\r\n\r\n") {
            let read = stream.by_ref().take((MAX_HEAD - bytes.len()) as u64).read_until(b'\n', &mut bytes)?;
            if read == 0 {
                return if bytes.is_empty() { Ok(None) } else { Err(invalid("the head does not end")) };
            }
        }
        Self::parse(&bytes).map(Some)
    }

    fn parse(bytes: &[u8]) -> io::Result<Self> {
        let mut lines = [httparse::EMPTY_HEADER; MAX_LINES];
        let mut parsed = httparse::Request::new(&mut lines);
        parsed.parse(bytes).map_err(|error| invalid(&error.to_string()))?;
        let mut head = Self {
            method: parsed.method.unwrap_or_default().into(),
            path: parsed.path.unwrap_or_default().into(),
            closes: parsed.version != Some(1),
            ..Self::default()
        };
        for line in parsed.headers.iter() {
            let value = || String::from_utf8_lossy(line.value).trim().to_owned();
            match line.name.to_ascii_lowercase().as_str() {
                "host" if head.host.is_some() => return Err(invalid("there are two hosts")),
                "host" => head.host = Some(value()),
                "origin" => head.origin = Some(value()),
                "last-event-id" => head.last_event = value().parse().ok(),
                "content-length" => head.length = value().parse().map_err(|_| invalid("Content-Length"))?,
                // Nothing else is sent by browsers.
                "transfer-encoding" => return Err(invalid("a body without Content-Length")),
                "expect" => head.waits = true,
                "connection" => head.closes |= value().eq_ignore_ascii_case("close"),
                _ => {}
            }
        }
        Ok(head)
    }

    /// The body as text.
    ///
    /// # Errors
    /// If it is too long, ends early or is no UTF-8.
    pub(super) fn text(&self, stream: &mut impl Read) -> io::Result<String> {
        if self.length > MAX_TEXT {
            return Err(invalid("the body is too long"));
        }
        let mut bytes = vec![0; self.length as usize];
        stream.read_exact(&mut bytes)?;
        String::from_utf8(bytes).map_err(|_| invalid("the body is no UTF-8"))
    }

    /// Whether the request was meant for this server and, if it says so, comes from its own page.
    pub(super) fn is_of_own_page(&self) -> bool {
        let Some(host) = &self.host else { return false };
        is_address(host) && self.origin.as_ref().is_none_or(|origin| *origin == format!("http://{host}"))
    }
}

/// Whether a host is an address or this machine, with or without a port. Another name may be anybody's.
fn is_address(host: &str) -> bool {
    if host.parse::<std::net::SocketAddr>().is_ok() || host.parse::<std::net::IpAddr>().is_ok() {
        return true;
    }
    let (name, port) = host.rsplit_once(':').unwrap_or((host, "0"));
    name.eq_ignore_ascii_case("localhost") && port.parse::<u16>().is_ok()
}

pub(super) fn invalid(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(text: &str) -> io::Result<Option<Head>> {
        Head::read(&mut text.as_bytes())
    }

    #[test]
    fn a_head_is_read_and_the_body_is_left() {
        let text = "POST /a/show HTTP/1.1\r\nHost: 127.0.0.1:80\r\ncontent-length: 2\r\nLast-Event-ID: 7\r\n\r\n{}GET";
        let mut stream = text.as_bytes();
        let head = Head::read(&mut stream).unwrap().unwrap();
        assert_eq!((head.method.as_str(), head.path.as_str()), ("POST", "/a/show"));
        assert_eq!((head.length, head.last_event, head.closes), (2, Some(7), false));
        assert_eq!(head.text(&mut stream).unwrap(), "{}");
        assert_eq!(stream, b"GET");
    }

    #[test]
    fn what_is_no_request_is_an_error() {
        assert_eq!(head("").unwrap(), None);
        let long = format!("GET / HTTP/1.1\r\nA: {}\r\n\r\n", "x".repeat(MAX_HEAD));
        let many = format!("GET / HTTP/1.1\r\n{}\r\n", "A: b\r\n".repeat(MAX_LINES + 1));
        let two_hosts = "GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n";
        let chunked = "POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n";
        for text in ["GET / HTTP/1.1\r\n", "\u{1}\u{2}\r\n\r\n", &long, &many, two_hosts, chunked] {
            assert!(head(text).is_err(), "{text:?}");
        }
        for length in ["-1", "x", "99999999999999999999999"] {
            assert!(
                head(&format!("PUT / HTTP/1.1\r\nContent-Length: {length}\r\n\r\n")).is_err(),
                "{length}"
            );
        }
        let huge = head(&format!("PUT / HTTP/1.1\r\nContent-Length: {}\r\n\r\n", u64::MAX)).unwrap().unwrap();
        assert!(huge.text(&mut [].as_slice()).is_err());
    }

    #[test]
    fn a_foreign_host_or_origin_is_not_of_the_page() {
        let of = |host: Option<&str>, origin: Option<&str>| {
            let [host, origin] = [host, origin].map(|text| text.map(str::to_owned));
            Head { host, origin, ..Head::default() }.is_of_own_page()
        };
        for host in ["127.0.0.1:8080", "localhost:9000", "[::1]:80", "localhost", "192.168.0.7:80"] {
            assert!(of(Some(host), None), "{host}");
            assert!(of(Some(host), Some(&format!("http://{host}"))));
            assert!(!of(Some(host), Some("http://evil.example")) && !of(Some(host), Some("null")));
        }
        for host in
            ["evil.example", "evil.example:8080", "localhost.evil.example", "127.0.0.1.evil.example:80"]
        {
            assert!(!of(Some(host), None), "{host}");
        }
        assert!(!of(None, None));
    }
}
