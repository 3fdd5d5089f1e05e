//! What a drive tells of itself, as text and as JSON.

use std::fmt::Write as _;

use gmhm::link::{Identified, LinkDiagnostics, Live, Origin, Status};
use serde::Serialize;

/// Whether the drive compensates, and how much.
pub(super) fn compensation(on: bool, gain_ratio: f32) -> String {
    format!("compensation {}, gain ratio {gain_ratio}", if on { "on" } else { "off" })
}

/// A line for each counter.
pub(super) fn counters(diagnostics: &LinkDiagnostics) -> String {
    let LinkDiagnostics { joint, line, refused_requests, expired_trials, bound } = diagnostics;
    let mut text = String::new();
    for (name, count) in [
        ("samples refused", joint.refused),
        ("samples out of range", joint.out_of_range),
        ("samples quarantined", joint.quarantined),
        ("new starts", joint.restarted),
        ("torques saturated", joint.saturated),
        ("turning points merged", joint.merged_pairs),
        ("frames", line.frames),
        ("bad checksums", line.bad_checksums),
        ("malformed frames", line.malformed),
        ("requests refused", *refused_requests),
        ("trials expired", *expired_trials),
    ] {
        // A string takes everything.
        let _ = writeln!(text, "{name:<24}{count}");
    }
    let _ = writeln!(text, "{:<24}{}", "last fault", joint.last.name());
    let _ = writeln!(text, "{:<24}{}", "self-test", joint.self_test.name());
    let _ = writeln!(text, "{:<24}{bound}", "bound while enabled");
    text
}

/// Who a drive is and what is in force.
#[derive(Debug, Serialize)]
pub(super) struct State {
    gear: String,
    scalar: &'static str,
    turning_points: u16,
    room_bytes: u32,
    block_format: u16,
    origin: &'static str,
    sequence: u32,
    crc32: u32,
    length_bytes: u32,
    stored_sequence: u32,
    boot_error: u16,
    enabled: bool,
    compensating: bool,
    gain_ratio: f32,
    locked: bool,
}

impl State {
    pub(super) fn of(drive: Identified, status: Status) -> Self {
        Self {
            gear: drive.gear.label().to_string(),
            scalar: drive.scalar.name(),
            turning_points: drive.stack_depth,
            room_bytes: drive.room,
            block_format: drive.format_version,
            origin: match status.origin {
                Origin::Nowhere => "nowhere",
                Origin::Stored => "stored",
                Origin::Trial => "trial",
            },
            sequence: status.sequence,
            crc32: status.crc,
            length_bytes: status.length,
            stored_sequence: status.stored_sequence,
            boot_error: status.boot_error,
            enabled: status.enabled,
            compensating: status.compensating,
            gain_ratio: status.gain_ratio,
            locked: drive.challenge.is_some(),
        }
    }

    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        let mut line = |name: &str, value: String| {
            // A string takes everything.
            let _ = writeln!(text, "{name:<14}{value}");
        };
        line("gear", if self.gear.is_empty() { "any".to_owned() } else { format!("\"{}\"", self.gear) });
        line(
            "computes in",
            format!(
                "{}, {} turning points, blocks of up to {} bytes",
                self.scalar, self.turning_points, self.room_bytes
            ),
        );
        let block = format!("sequence {}, CRC-32 {:#010x}, {} bytes", self.sequence, self.crc32, self.length_bytes);
        line(
            "in force",
            match self.origin {
                "nowhere" => "nothing".to_owned(),
                "trial" => format!("on trial, in RAM: {block}"),
                _ => format!("as stored: {block}"),
            },
        );
        line(
            "newest stored",
            match self.stored_sequence {
                0 => "none".to_owned(),
                sequence => format!("sequence {sequence}"),
            },
        );
        if self.boot_error != 0 {
            line("boot error", format!("{:#06x}: the newest stored block could not be loaded", self.boot_error));
        }
        line("drive", if self.enabled { "enabled" } else { "disabled" }.to_owned());
        line("state", compensation(self.compensating, self.gain_ratio));
        line("access", if self.locked { "locked: changes need the key" } else { "open to any host" }.to_owned());
        text
    }
}

/// What a drive measures and computes at a moment.
#[derive(Debug, Serialize)]
pub(super) struct Moment {
    /// Since the first.
    time_s: f64,
    deflection_rad: f32,
    torque_model_nm: f32,
    hysteresis_nm: f32,
    contribution_nm: f32,
    out_of_range: bool,
    refused: bool,
    ticks: u32,
    loop_cost: u32,
}

impl Moment {
    pub(super) const HEADER: &str =
        "  time_s  deflection_rad  torque_model_nm  hysteresis_nm  contribution_nm       ticks  loop_cost  flags";

    pub(super) fn of(time_s: f64, live: &Live) -> Self {
        Self {
            time_s,
            deflection_rad: live.deflection_rad,
            torque_model_nm: live.torque_nm,
            hysteresis_nm: live.hysteresis_nm,
            contribution_nm: live.contribution_nm,
            out_of_range: live.out_of_range,
            refused: live.refused,
            ticks: live.ticks,
            loop_cost: live.loop_cost,
        }
    }

    pub(super) fn text(&self) -> String {
        let flags = match (self.out_of_range, self.refused) {
            (false, false) => "",
            (true, false) => "out of range",
            (false, true) => "refused",
            (true, true) => "out of range, refused",
        };
        let line = format!(
            "{:8.3}  {:14.6e}  {:15.5}  {:13.5}  {:15.5}  {:10}  {:9}  {flags}",
            self.time_s,
            self.deflection_rad,
            self.torque_model_nm,
            self.hysteresis_nm,
            self.contribution_nm,
            self.ticks,
            self.loop_cost
        );
        line.trim_end().to_owned()
    }
}
