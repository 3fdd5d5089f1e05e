//! What a drive tells of itself, as text and as JSON.

use std::fmt::{Display, Write as _};

use gmhm::diagnostics::Diagnostics;
use gmhm::link::{Identified, LinkDiagnostics, Live, Status};
use serde::Serialize;

/// Whether the drive compensates, and how much.
pub(super) fn compensation(on: bool, gain_ratio: f32) -> String {
    format!("compensation {}, gain ratio {gain_ratio}", if on { "on" } else { "off" })
}

/// What the last sample was, if not good.
pub(super) fn flags(out_of_range: bool, refused: bool) -> &'static str {
    match (out_of_range, refused) {
        (false, false) => "",
        (true, false) => "out of range",
        (false, true) => "refused",
        (true, true) => "out of range, refused",
    }
}

/// What a drive has counted on its control path since the counters were cleared.
#[derive(Debug, Serialize)]
pub(super) struct Counters {
    samples_refused: u32,
    samples_out_of_range: u32,
    samples_quarantined: u32,
    new_starts: u32,
    torques_saturated: u32,
    turning_points_merged: u32,
    last_fault: &'static str,
    self_test: &'static str,
}

impl Counters {
    pub(super) fn of(joint: &Diagnostics) -> Self {
        Self {
            samples_refused: joint.refused,
            samples_out_of_range: joint.out_of_range,
            samples_quarantined: joint.quarantined,
            new_starts: joint.restarted,
            torques_saturated: joint.saturated,
            turning_points_merged: joint.merged_pairs,
            last_fault: joint.last.name(),
            self_test: joint.self_test.name(),
        }
    }

    /// Each count with its name in full, and in short as [`Fault`](gmhm::diagnostics::Fault) has it.
    fn counts(&self) -> [(&'static str, &'static str, u32); 6] {
        [
            ("samples refused", "refused", self.samples_refused),
            ("samples out of range", "out of range", self.samples_out_of_range),
            ("samples quarantined", "quarantined", self.samples_quarantined),
            ("new starts", "restarted", self.new_starts),
            ("torques saturated", "saturated", self.torques_saturated),
            ("turning points merged", "merged", self.turning_points_merged),
        ]
    }

    /// Each count by its short name.
    pub(super) fn short(&self) -> impl Iterator<Item = (&'static str, u32)> {
        self.counts().into_iter().map(|(_, short, count)| (short, count))
    }

    pub(super) fn last_fault(&self) -> &'static str {
        self.last_fault
    }

    /// What is not zero, on one line; empty without a fault.
    fn line(&self) -> String {
        let counted: Vec<String> =
            self.short().filter(|(_, count)| *count > 0).map(|(name, count)| format!("{name} {count}")).collect();
        if counted.is_empty() { String::new() } else { format!("{}; last {}", counted.join(", "), self.last_fault) }
    }
}

/// What has gone wrong in a drive: on its control path, on the line, in the link.
#[derive(Debug, Serialize)]
pub(super) struct Counted {
    #[serde(flatten)]
    joint: Counters,
    frames: u32,
    bad_checksums: u32,
    malformed_frames: u32,
    requests_refused: u32,
    trials_expired: u32,
    /// Infinite, in JSON null: none.
    bound_while_enabled: f32,
}

impl Counted {
    pub(super) fn of(diagnostics: &LinkDiagnostics) -> Self {
        let LinkDiagnostics { joint, line, refused_requests, expired_trials, bound } = diagnostics;
        Self {
            joint: Counters::of(joint),
            frames: line.frames,
            bad_checksums: line.bad_checksums,
            malformed_frames: line.malformed,
            requests_refused: *refused_requests,
            trials_expired: *expired_trials,
            bound_while_enabled: *bound,
        }
    }

    /// A line for each.
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        let mut line = |name: &str, value: &dyn Display| {
            // A string takes everything.
            let _ = writeln!(text, "{name:<24}{value}");
        };
        for (name, _, count) in self.joint.counts() {
            line(name, &count);
        }
        line("frames", &self.frames);
        line("bad checksums", &self.bad_checksums);
        line("malformed frames", &self.malformed_frames);
        line("requests refused", &self.requests_refused);
        line("trials expired", &self.trials_expired);
        line("last fault", &self.joint.last_fault);
        line("self-test", &self.joint.self_test);
        line("bound while enabled", &self.bound_while_enabled);
        text
    }
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
            origin: status.origin.name(),
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
                "stored" => format!("as stored: {block}"),
                origin => format!("{origin}: {block}"),
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
    diagnostics: Counters,
}

impl Moment {
    pub(super) const HEADER: &str = "  time_s  deflection_rad  torque_model_nm  hysteresis_nm  contribution_nm       ticks  loop_cost  flags                  counted faults";

    pub(super) fn of(time_s: f64, live: &Live, diagnostics: &Diagnostics) -> Self {
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
            diagnostics: Counters::of(diagnostics),
        }
    }

    pub(super) fn text(&self) -> String {
        let flags = flags(self.out_of_range, self.refused);
        let line = format!(
            "{:8.3}  {:14.6e}  {:15.5}  {:13.5}  {:15.5}  {:10}  {:9}  {flags:<21}  {}",
            self.time_s,
            self.deflection_rad,
            self.torque_model_nm,
            self.hysteresis_nm,
            self.contribution_nm,
            self.ticks,
            self.loop_cost,
            self.diagnostics.line()
        );
        line.trim_end().to_owned()
    }
}
