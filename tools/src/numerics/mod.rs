//! Numerical methods: least squares, search, noise models. Nothing here knows a gear.
//!
//! | file | what |
//! |---|---|
//! | [`vector`] | sums and updates of long columns |
//! | [`qr`], [`basis`], [`svd`] | streaming triangular factor, orthonormal basis, singular directions |
//! | [`block_gram`], `subset_errors`, `further_columns` | held-out errors of any subset of columns; of many at once; what some save beside others |
//! | [`bounded`] | least squares with bounds |
//! | [`levenberg_marquardt`], [`particle_swarm`] | local and global search |
//! | [`autoregression`], `whitening` | coloured noise and its filter |
//! | [`robust`] | median, standard deviation from it |
//! | `smoothing`, [`spectrum`] | graduation; lines over orders of a turn |

pub mod autoregression;
pub mod basis;
pub mod block_gram;
pub mod bounded;
pub mod extremes;
mod further_columns;
pub mod levenberg_marquardt;
pub mod mark;
pub mod particle_swarm;
pub mod qr;
pub mod robust;
pub(crate) mod smoothing;
pub mod spectrum;
mod subset_errors;
pub mod svd;
pub mod vector;
pub(crate) mod whitening;
