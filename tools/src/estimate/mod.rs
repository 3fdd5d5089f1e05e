//! Identification: columns, noise, swarm, polish, uncertainty.
