//! A bad line: a proxy in front of a real server that delays what it passes on, stops, or flips a bit.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// How often a thread looks whether it should end.
const STOP_INTERVAL: Duration = Duration::from_millis(5);

/// What is wrong with a line. Bytes are counted for each connection, in both directions together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fault {
    #[default]
    None,
    /// Everything arrives so much later, in each direction.
    Delay(Duration),
    /// The connection is closed after so many bytes.
    CutAfter(u64),
    /// After so many bytes nothing arrives any more, and nobody is told.
    StallAfter(u64),
    /// One bit of this byte arrives flipped.
    Flip(u64),
}

#[derive(Debug, Default)]
struct State {
    fault: Mutex<Fault>,
    /// The bytes that were passed on, of all connections.
    passed: AtomicU64,
    ended: AtomicBool,
    connections: Mutex<Vec<Arc<Connection>>>,
}

#[derive(Debug, Default)]
struct Connection {
    passed: AtomicU64,
    closed: AtomicBool,
}

/// A proxy, closed at the end.
#[derive(Debug)]
pub struct Proxy {
    port: u16,
    state: Arc<State>,
}

impl Proxy {
    /// A proxy in front of the server at a port of this machine.
    pub fn start(target: u16, fault: Fault) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let state = Arc::new(State { fault: Mutex::new(fault), ..State::default() });
        let shared = Arc::clone(&state);
        std::thread::spawn(move || {
            for client in listener.incoming().map_while(Result::ok) {
                if shared.ended.load(Ordering::Relaxed) {
                    return;
                }
                // A server that is gone closes the connection.
                if let Ok(server) = TcpStream::connect(("127.0.0.1", target)) {
                    connect(&shared, &client, &server);
                }
            }
        });
        Self { port, state }
    }

    /// The option that names the server behind it.
    pub fn address(&self) -> String {
        format!("--remote-cache={}", self.url())
    }

    pub fn url(&self) -> String {
        format!("grpc://127.0.0.1:{}", self.port)
    }

    /// The bytes that were passed on so far.
    pub fn passed(&self) -> u64 {
        self.state.passed.load(Ordering::Relaxed)
    }

    /// Closes all connections at once. One with bytes that were not yet passed on is reset.
    pub fn reset(&self) {
        for connection in self.state.connections.lock().unwrap().drain(..) {
            connection.closed.store(true, Ordering::Relaxed);
        }
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        self.state.ended.store(true, Ordering::Relaxed);
        self.reset();
        // Wakes the thread that waits for a connection.
        let _ = TcpStream::connect(("127.0.0.1", self.port));
    }
}

fn connect(state: &Arc<State>, client: &TcpStream, server: &TcpStream) {
    let connection = Arc::new(Connection::default());
    state.connections.lock().unwrap().push(Arc::clone(&connection));
    for (from, to) in [(client, server), (server, client)] {
        from.set_read_timeout(Some(STOP_INTERVAL)).unwrap();
        to.set_nodelay(true).unwrap();
        let (from, to) = (from.try_clone().unwrap(), to.try_clone().unwrap());
        let (sender, receiver) = channel();
        let (state, reading) = (Arc::clone(state), Arc::clone(&connection));
        std::thread::spawn(move || read(&state, &reading, from, &sender));
        let writing = Arc::clone(&connection);
        std::thread::spawn(move || write(&writing, to, &receiver));
    }
}

/// Bytes, and when they arrive.
type Piece = (Instant, Vec<u8>);

fn read(state: &State, connection: &Connection, mut from: TcpStream, sender: &Sender<Piece>) {
    let mut buffer = vec![0; 64 << 10];
    let is_open = || !connection.closed.load(Ordering::Relaxed) && !state.ended.load(Ordering::Relaxed);
    while is_open() {
        let count = match from.read(&mut buffer) {
            Ok(0) => return,
            Ok(count) => count,
            Err(error) if [ErrorKind::WouldBlock, ErrorKind::TimedOut].contains(&error.kind()) => continue,
            Err(_) => return,
        };
        let mut data = buffer[..count].to_vec();
        let fault = *state.fault.lock().unwrap();
        let before = connection.passed.fetch_add(count as u64, Ordering::Relaxed);
        // The place of a byte of the connection in this piece, or its end.
        let place = |byte: u64| usize::try_from(byte.saturating_sub(before)).unwrap().min(count);
        let (mut due, mut most) = (Instant::now(), count);
        match fault {
            Fault::None => {}
            Fault::Delay(delay) => due += delay,
            Fault::CutAfter(bytes) | Fault::StallAfter(bytes) => most = place(bytes),
            Fault::Flip(byte) if byte >= before => {
                if let Some(byte) = data.get_mut(place(byte)) {
                    *byte ^= 0x10;
                }
            }
            Fault::Flip(_) => {}
        }
        data.truncate(most);
        state.passed.fetch_add(most as u64, Ordering::Relaxed);
        if sender.send((due, data)).is_err() || matches!(fault, Fault::CutAfter(_) if most < count) {
            return;
        }
        while most < count && is_open() {
            std::thread::sleep(STOP_INTERVAL);
        }
    }
}

/// Passes on what was read, until nothing more comes; then the connection is closed in both directions.
fn write(connection: &Connection, mut to: TcpStream, receiver: &Receiver<Piece>) {
    for (due, data) in receiver {
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        if connection.closed.load(Ordering::Relaxed) || to.write_all(&data).is_err() {
            break;
        }
    }
    connection.closed.store(true, Ordering::Relaxed);
}
