//! stub

mod axes;
mod bevy;
mod json;
mod light;
#[cfg(test)]
mod testkit;
mod three;
