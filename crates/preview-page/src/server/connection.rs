//! A connection of a browser: its requests, one after the other.

use std::io::{self, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::Duration;

use super::request::{Head, invalid};
use super::response::Response;
use super::session::Session;

/// How long a browser may take for the next bytes of a request, or to take those of a response.
const PATIENCE: Duration = Duration::from_secs(30);

/// An event stream says at least so often that it is alive, which also finds browsers that went away.
const PULSE: Duration = Duration::from_secs(10);

/// The most bytes of a request that are read although it was refused, and how long the next of them may take.
const MAX_IGNORED: u64 = 64 << 20;
const IGNORED_PATIENCE: Duration = Duration::from_secs(1);

/// Answers one connection too many.
pub(super) fn refuse(mut stream: TcpStream) -> io::Result<()> {
    stream.set_write_timeout(Some(PATIENCE))?;
    Response::busy().write(&mut stream, true, true)
}

/// Answers requests until the connection ends.
pub(super) fn talk(mut stream: TcpStream, session: &Session) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let mut reader = BufReader::new(stream.try_clone()?);
    loop {
        let head = match Head::read(&mut reader) {
            Ok(Some(head)) => head,
            Ok(None) => return Ok(()),
            Err(error) if error.kind() == io::ErrorKind::InvalidData => {
                Response::bad(&error.to_string()).write(&mut stream, true, true)?;
                return close(&stream, &mut reader);
            }
            Err(error) => return Err(error),
        };
        let path = head.path.strip_prefix('/').and_then(|path| path.strip_prefix(session.token()));
        let Some(path) = path.and_then(|path| path.strip_prefix('/')).filter(|_| head.is_of_own_page())
        else {
            // The body is not read, so nothing can follow.
            Response::nothing().write(&mut stream, head.method != "HEAD", true)?;
            return close(&stream, &mut reader);
        };
        if path == "events" && head.method == "GET" {
            return send_events(&mut stream, session, head.last_event);
        }
        if head.waits {
            stream.write_all(b"HTTP/1.1 100 Continue\r\n\r\n")?;
        }
        let (response, is_read) = answer(&head, path, &mut reader, session)?;
        let closes = head.closes || !is_read;
        response.write(&mut stream, head.method != "HEAD", closes)?;
        if closes {
            return close(&stream, &mut reader);
        }
    }
}

/// Ends a connection. What still comes is read: otherwise the system would tell the browser that the
/// connection is broken, which then does not read the response.
fn close(stream: &TcpStream, reader: &mut impl Read) -> io::Result<()> {
    stream.shutdown(Shutdown::Write)?;
    stream.set_read_timeout(Some(IGNORED_PATIENCE))?;
    io::copy(&mut reader.by_ref().take(MAX_IGNORED), &mut io::sink()).map(drop)
}

/// The response to a request, and whether its body was read to its end.
fn answer(head: &Head, path: &str, body: &mut impl Read, session: &Session) -> io::Result<(Response, bool)> {
    Ok(match head.method.as_str() {
        "GET" | "HEAD" => (session.get(path), head.length == 0),
        "PUT" => match path.strip_prefix("file/") {
            Some(name) => session.receive(name, head.length, body)?,
            None => (Response::nothing(), false),
        },
        "POST" => match head.text(body) {
            Ok(text) => (session.post(path, &text), true),
            Err(error) if error.kind() == io::ErrorKind::InvalidData => {
                (Response::bad(&error.to_string()), false)
            }
            Err(error) => return Err(error),
        },
        _ => (Response::bad("an unknown method"), false),
    })
}

/// Sends events as they come, until the browser goes away or the preview closes.
fn send_events(stream: &mut TcpStream, session: &Session, last: Option<u64>) -> io::Result<()> {
    Response::begin_events(stream)?;
    let mut last = last;
    loop {
        let (events, now) = session.events_after(last, PULSE);
        last = Some(now);
        let mut text = String::new();
        for event in &events {
            text += &format!("id: {}\nevent: {}\ndata: {}\n\n", event.number, event.name, event.data);
        }
        if text.is_empty() {
            text += ": \n\n";
        }
        stream.write_all(text.as_bytes())?;
        stream.flush()?;
        if events.iter().any(|event| event.name == "close") {
            return Err(invalid("closed"));
        }
    }
}
