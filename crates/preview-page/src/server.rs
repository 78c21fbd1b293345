//! The page over HTTP: what a preview shows, sent to browsers as it changes, and their requests to the
//! program around it ([`preview::Host`]).
//!
//! Only those who have the link get anything: its path begins with a token of 128 random bits. A request
//! must name a host that is an address or `localhost`, so that no page of elsewhere reaches the server by a
//! name that it gave to this machine (DNS rebinding), and comes from this page if it says from where.

mod connection;
mod event_log;
mod form_json;
mod live_scene;
mod request;
mod response;
mod session;
mod uploads;

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use preview::{Host, InitialView, PreviewUpdate};

use self::session::Session;

/// The most connections at the same time. A page has one for its events, and a browser opens up to six.
const MAX_CONNECTIONS: usize = 32;

/// A server of a page. Copies are the same server.
#[derive(Clone)]
pub struct PageServer {
    session: Arc<Session>,
    address: SocketAddr,
}

/// Serves a page at an address, of which port 0 is any free one, until the process ends. `title` is the name
/// of what it shows, and `view` what it shows first.
///
/// # Errors
/// If the address cannot be listened to.
pub fn serve(
    address: SocketAddr,
    title: &str,
    view: InitialView,
    host: Box<dyn Host>,
) -> io::Result<PageServer> {
    let listener = TcpListener::bind(address)?;
    let address = listener.local_addr()?;
    let session = Arc::new(Session::new(title, token()?, view, host)?);
    let server = PageServer { session: Arc::clone(&session), address };
    let accept = move || {
        let connections = Arc::new(AtomicUsize::new(0));
        for stream in listener.incoming().flatten() {
            let (session, connections) = (Arc::clone(&session), Arc::clone(&connections));
            let is_one_too_many = connections.fetch_add(1, Ordering::Relaxed) >= MAX_CONNECTIONS;
            let talk = move || {
                // A browser that goes away in the middle of an answer is no error of ours.
                let _ = match is_one_too_many {
                    true => connection::refuse(stream),
                    false => connection::talk(stream, &session),
                };
                connections.fetch_sub(1, Ordering::Relaxed);
            };
            // Without a thread the connection is dropped, and the browser tries again.
            let _ = thread::Builder::new().name("page connection".into()).spawn(talk);
        }
    };
    thread::Builder::new().name("page server".into()).spawn(accept)?;
    Ok(server)
}

impl PageServer {
    /// The link to the page.
    pub fn link(&self) -> String {
        let address = match self.address.ip().is_unspecified() {
            true => SocketAddr::new(own_address(), self.address.port()),
            false => self.address,
        };
        format!("http://{address}/{}/", self.session.token())
    }

    /// The port that it listens at.
    pub fn port(&self) -> u16 {
        self.address.port()
    }

    /// Shows an update in all browsers that have the page open, and in those that open it later.
    pub fn send(&self, update: PreviewUpdate) {
        self.session.update(update);
    }

    /// Waits until [`PreviewUpdate::Close`] is sent.
    pub fn wait(&self) {
        self.session.wait_until_closed();
    }
}

/// 128 random bits in hexadecimal.
fn token() -> io::Result<String> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(|error| io::Error::other(error.to_string()))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// The address of this machine that others reach it by: that from which it would send to one elsewhere.
/// Nothing is sent.
fn own_address() -> IpAddr {
    let elsewhere = (Ipv4Addr::new(192, 0, 2, 1), 9); // an address for documentation
    let found = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).and_then(|socket| {
        socket.connect(elsewhere)?;
        socket.local_addr()
    });
    found.map_or(Ipv4Addr::LOCALHOST.into(), |address| address.ip())
}
