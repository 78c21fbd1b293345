//! stub

mod axes;
mod json;
mod light;
#[cfg(test)]
mod testkit;
mod three;
