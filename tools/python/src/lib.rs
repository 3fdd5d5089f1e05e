//! The native module of the Python package `gmhm`: the host library's own functions over NumPy arrays.
//!
//! | file | what |
//! |---|---|
//! | `job` | work on the tools' threads, without the interpreter's lock; Ctrl-C |
//! | `errors` | failures as exceptions, in the same words |
//! | `lent` | arrays of Python that recordings read where they lie |
//! | `options` | words of options as the types of the library |
//! | `recording`, `model` | the two classes |
//! | `commands` | `fit`, `diagnose`, `health` |
//!
//! Names, docstrings and results for people are in the Python sources beside it.

mod commands;
mod errors;
mod job;
mod lent;
mod model;
mod options;
mod recording;

use pyo3::prelude::*;

#[pymodule]
mod _gmhm {
    #[pymodule_export]
    use crate::commands::{diagnose, fit, health_of_models, health_of_recordings};
    #[pymodule_export]
    use crate::model::{Model, inspect, read_block, write_block};
    #[pymodule_export]
    use crate::recording::{Recording, demo, read_columns, read_file};
}
