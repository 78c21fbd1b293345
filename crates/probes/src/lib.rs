//! Light where there is no surface.
