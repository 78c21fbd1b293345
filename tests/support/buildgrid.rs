//! A second real server of the Remote Execution API, BuildGrid: a cache that knows TLS, certificates of
//! clients, and tokens.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use tempfile::TempDir;

use super::casd::{free_port, installed};

/// Whom a server lets in.
#[derive(Clone, Copy, Debug, Default)]
pub struct Access<'a> {
    /// The server speaks TLS with a certificate of this authority.
    pub tls: Option<&'a Authority>,
    /// Clients need a certificate of the same authority.
    pub needs_certificate: bool,
    /// Clients need a token that is signed with this secret.
    pub secret: Option<&'a str>,
}

/// A server with a cache of its own, killed at the end.
pub struct BuildGrid {
    port: u16,
    folder: TempDir,
    child: Child,
}

impl BuildGrid {
    pub fn start(test: &str, access: Access<'_>) -> Option<Self> {
        static PROGRAM: OnceLock<Option<PathBuf>> = OnceLock::new();
        let program = installed(test, "BuildGrid", "tests/remote/install-buildgrid.sh", &PROGRAM)?;
        let (port, folder) = (free_port(), tempfile::tempdir().unwrap());
        let configuration = folder.path().join("cache.yml");
        fs::write(&configuration, self::configuration(port, folder.path(), access)).unwrap();
        let mut command = Command::new(program);
        command.arg("server").arg("start").arg(&configuration).stdin(Stdio::null());
        let log = fs::File::create(folder.path().join("log")).unwrap();
        let child = command.stdout(log.try_clone().unwrap()).stderr(log).spawn().unwrap();
        let mut server = Self { port, folder, child };
        let deadline = Instant::now() + Duration::from_secs(60);
        while std::net::TcpStream::connect(("127.0.0.1", port)).is_err() {
            let log = || fs::read_to_string(server.folder.path().join("log")).unwrap_or_default();
            assert!(server.child.try_wait().unwrap().is_none(), "BuildGrid ended: {}", log());
            assert!(Instant::now() < deadline, "BuildGrid does not listen: {}", log());
            std::thread::sleep(Duration::from_millis(50));
        }
        Some(server)
    }

    /// The option that names its cache, by this scheme.
    pub fn address(&self, scheme: &str) -> String {
        format!("--remote-cache={scheme}://localhost:{}", self.port)
    }
}

impl Drop for BuildGrid {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn configuration(port: u16, folder: &Path, access: Access<'_>) -> String {
    let mut text = format!("server:\n- !channel\n  address: \"127.0.0.1:{port}\"\n");
    match access.tls {
        None => text += "  insecure-mode: true\n",
        Some(authority) => {
            let file = |name: &str| authority.file(name);
            text += "  insecure-mode: false\n  credentials:\n";
            text += &format!("    tls-server-key: {}\n", file("server.key"));
            text += &format!("    tls-server-cert: {}\n", file("server.pem"));
            if access.needs_certificate {
                text += &format!("    tls-client-certs: {}\n", file("authority.pem"));
            }
        }
    }
    match access.secret {
        None => text += "authorization:\n  method: none\n",
        Some(secret) => {
            let file = folder.join("secret");
            fs::write(&file, secret).unwrap();
            let file = file.display();
            text += &format!("authorization:\n  method: jwt\n  secret: {file}\n  algorithm: hs256\n");
            text += "  audience: specula\n";
        }
    }
    text + &format!(
        "storages:\n- !disk-storage &storage\n  path: {}\n\
         caches:\n- !lru-action-cache &results\n  storage: *storage\n  max-cached-refs: 100000\n  \
         allow-updates: true\n  cache-failed-actions: false\n\
         instances:\n- name: ''\n  description: main\n  services:\n  \
         - !action-cache\n    cache: *results\n  - !cas\n    storage: *storage\n  \
         - !bytestream\n    storage: *storage\n\
         monitoring:\n  enabled: false\nthread-pool-size: 20\ndescription: a cache\n",
        folder.join("cas").display()
    )
}

/// An authority that signs certificates, with one of a server at `localhost` and one of a client.
#[derive(Debug)]
pub struct Authority {
    folder: TempDir,
}

impl Authority {
    /// `None` if there is no openssl.
    pub fn new(test: &str) -> Option<Self> {
        if !Command::new("openssl").arg("version").output().is_ok_and(|output| output.status.success()) {
            test_data::skip(test, "there is no program openssl");
            return None;
        }
        let authority = Self { folder: tempfile::tempdir().unwrap() };
        let key = "-newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes";
        authority.openssl(&format!(
            "req -x509 {key} -keyout authority.key -out authority.pem -days 2 -subj /CN=studio"
        ));
        for (name, usage) in [("server", "serverAuth"), ("client", "clientAuth")] {
            let extensions = format!(
                "subjectAltName=DNS:localhost,IP:127.0.0.1\nextendedKeyUsage={usage}\n\
                 basicConstraints=CA:FALSE\n"
            );
            fs::write(authority.folder.path().join("extensions"), extensions).unwrap();
            authority
                .openssl(&format!("req -new {key} -keyout {name}.key -out {name}.csr -subj /CN=localhost"));
            authority.openssl(&format!(
                "x509 -req -in {name}.csr -out {name}.pem -days 2 -extfile extensions \
                 -CA authority.pem -CAkey authority.key -CAcreateserial"
            ));
        }
        Some(authority)
    }

    fn openssl(&self, arguments: &str) -> Vec<u8> {
        let mut command = Command::new("openssl");
        let output = command.args(arguments.split_whitespace()).current_dir(self.folder.path()).output();
        let Output { status, stdout, stderr } = output.unwrap();
        assert!(status.success(), "openssl {arguments}: {}", String::from_utf8_lossy(&stderr));
        stdout
    }

    /// The path of one of its files: `authority`, `server` or `client`, each `.pem` and `.key`.
    pub fn file(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    /// The option that trusts it.
    pub fn trust(&self) -> String {
        format!("--tls-certificate={}", self.file("authority.pem"))
    }

    /// The options with the client's certificate.
    pub fn client(&self) -> [String; 2] {
        let (certificate, key) = (self.file("client.pem"), self.file("client.key"));
        [format!("--tls-client-certificate={certificate}"), format!("--tls-client-key={key}")]
    }

    /// A JSON Web Token for `specula`, signed with HMAC-SHA256 by a secret, that expires in so many seconds.
    pub fn token(&self, secret: &str, seconds: i64) -> String {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs().cast_signed();
        let claims = format!("{{\"aud\":\"specula\",\"sub\":\"artist\",\"exp\":{}}}", now + seconds);
        let signed =
            format!("{}.{}", base64url(br#"{"alg":"HS256","typ":"JWT"}"#), base64url(claims.as_bytes()));
        fs::write(self.folder.path().join("signed"), &signed).unwrap();
        let signature = self.openssl(&format!("dgst -sha256 -hmac {secret} -binary signed"));
        format!("{signed}.{}", base64url(&signature))
    }
}

/// Base64 with the letters of addresses and no padding.
fn base64url(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
    let mut text = String::new();
    for group in bytes.chunks(3) {
        let bits = group
            .iter()
            .enumerate()
            .fold(0, |bits, (index, byte)| bits | u32::from(*byte) << (16 - 8 * index));
        for index in 0..=group.len() {
            text.push(LETTERS[(bits >> (18 - 6 * index)) as usize % 64].into());
        }
    }
    text
}
