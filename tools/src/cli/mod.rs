//! The commands, one small file each; no mathematics here.
