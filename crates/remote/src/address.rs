//! Where a server is: `grpc://host:port`, `grpcs://host:port` or `unix:/path/of/a/socket`.

use std::fmt;

/// The address of a server.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    text: String,
}

/// An address that has none of the known forms.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is not the address of a server: expected grpc://HOST:PORT, grpcs://HOST:PORT or unix:PATH")]
pub struct AddressError(String);

impl Address {
    /// Reads an address, as Bazel's `--remote_cache` has it. Without a scheme it is `grpcs`.
    ///
    /// # Errors
    /// If it has another scheme, or no host.
    ///
    /// # Example: Bazel's default is TLS
    /// ```
    /// let address: remote::Address = remote::Address::parse("cache.studio:443").unwrap();
    /// assert_eq!(address.to_string(), "grpcs://cache.studio:443");
    /// assert!(remote::Address::parse("https://cache.studio").is_err());
    /// ```
    pub fn parse(text: &str) -> Result<Self, AddressError> {
        let error = || AddressError(text.to_owned());
        let rest = ["grpc://", "grpcs://", "unix:"].iter().find_map(|scheme| text.strip_prefix(scheme));
        match rest {
            Some(rest) if rest.trim_matches('/').is_empty() => Err(error()),
            Some(_) => Ok(Self { text: text.trim_end_matches('/').to_owned() }),
            None if text.is_empty() || text.contains("://") || text.contains(['/', ' ']) => Err(error()),
            None => Ok(Self { text: format!("grpcs://{text}") }),
        }
    }

    /// Whether the connection is encrypted.
    pub fn is_encrypted(&self) -> bool {
        self.text.starts_with("grpcs://")
    }

    /// The host and port, or the socket, for messages.
    pub fn host(&self) -> &str {
        self.text.split_once("://").map_or(&self.text, |(_, host)| host)
    }

    /// The address in the form that the HTTP library wants.
    pub(crate) fn uri(&self) -> String {
        match self.text.split_once("://") {
            Some(("grpc", host)) => format!("http://{host}"),
            Some((_, host)) => format!("https://{host}"),
            None => self.text.clone(),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}
