//! A second implementation of MODEL.md in f64, written apart from the core, to hold the core to.
