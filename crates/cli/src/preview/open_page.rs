//! Serves the page, and says where it is.

use std::env;
use std::sync::Arc;
use std::sync::mpsc::Sender;

use ::preview::{InitialView, PreviewUpdate};
use parking_lot::Mutex;

use super::controller::PreviewMessage;
use super::dropped;
use super::host::ViewHost;
use super::request::{Page, ViewRequest};
use crate::exit::Exit;
use crate::print::{self, say};

/// Serves a page until the preview is closed.
///
/// # Errors
/// If the address cannot be listened to.
pub(super) fn show(
    page: Page,
    request: &ViewRequest<'_>,
    view: InitialView,
    messages: &Sender<PreviewMessage>,
) -> Result<(), Exit> {
    let host = ViewHost { messages: messages.clone(), state: Arc::new(Mutex::new(view.state.clone())) };
    let title = dropped::name_of(request.project);
    let server = preview_page::serve(page.address, &title, view, Box::new(host)).map_err(|error| {
        let help = "`--serve ADDRESS` names another address, such as 127.0.0.1:0 for any free port";
        print::error(&[format!("cannot serve a page at {}", page.address), error.to_string()], Some(help));
        Exit::System
    })?;
    let link = server.link();
    say!("The page is at {link}");
    match forwarding(env::var("SSH_CONNECTION").ok().as_deref(), server.port()) {
        // A browser of this machine would not be seen.
        Some(how) => say!("{how}"),
        None if page.opens_browser && has_display(|name| env::var_os(name).is_some()) => {
            if let Err(error) = open::that_detached(&link) {
                say!("warning: cannot open a browser: {error}");
            }
        }
        None => {}
    }
    let updates = server.clone();
    let sends = move |update: PreviewUpdate| updates.send(update);
    let _ = messages.send(PreviewMessage::Opened(Box::new(sends)));
    server.wait();
    Ok(())
}

/// Whether a browser would have a screen. Without one, other systems than Windows and macOS would open one in
/// the terminal.
fn has_display(is_set: impl Fn(&str) -> bool) -> bool {
    cfg!(any(windows, target_os = "macos")) || is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")
}

/// How to see the page of a machine that somebody reached over SSH, whose variable `SSH_CONNECTION` names the
/// client's address and port and the server's.
fn forwarding(connection: Option<&str>, port: u16) -> Option<String> {
    let server = connection?.split(' ').nth(2).filter(|server| !server.is_empty())?;
    Some(format!(
        "On the machine that you sit at, `ssh -N -L {port}:127.0.0.1:{port} {server}` makes that link work."
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn over_ssh_the_port_has_to_be_forwarded() {
        let how = forwarding(Some("192.0.2.7 50000 198.51.100.2 22"), 8080).unwrap();
        assert!(how.contains("ssh -N -L 8080:127.0.0.1:8080 198.51.100.2"), "{how}");
        assert_eq!(forwarding(None, 8080), None);
        assert_eq!(forwarding(Some(""), 8080), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn no_browser_opens_in_a_terminal() {
        assert!(!has_display(|_| false));
        assert!(has_display(|name| name == "WAYLAND_DISPLAY") && has_display(|name| name == "DISPLAY"));
    }
}
