//! Why a fleet is not processed.

use std::path::PathBuf;

/// What is wrong with the file of lines.
#[derive(Debug, thiserror::Error)]
pub enum FleetError {
    /// It is there already.
    #[error("{}: exists already", .0.display())]
    Exists(PathBuf),
    /// A line in it is none of a fleet.
    #[error("{}: line {line} is not the result of a recording", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
    },
    /// Another run writes to it.
    #[error("{}: another run writes to it", .0.display())]
    Taken(PathBuf),
    /// The system refuses.
    #[error("{}: {source}", path.display())]
    System {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

impl FleetError {
    /// How to fix it.
    pub fn fix(&self) -> Option<String> {
        let text = match self {
            Self::Exists(_) => "continue it with --resume, or give another file",
            Self::Foreign { .. } => "give a file that --each wrote, or a new one",
            Self::Taken(_) => "give each run its own file, such as part-1.ndjson with --shard 1/2",
            Self::System { .. } => return None,
        };
        Some(text.to_owned())
    }
}
